"""`fieldcam tags`, `fieldcam segment`, `fieldcam disparity`: one stage alone, on any image."""

from __future__ import annotations

import argparse
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcam.cli.arguments import (
    Parser,
    Subparsers,
    add_command,
    add_json,
    positive_count,
)
from fieldcam.cli.card_size import add_block_of_cards, add_tag_size, tag_size_of
from fieldcam.cli.console import emit, emit_json, narrate, table
from fieldcam.cli.networks import checked_models, open_raft, open_segmenter
from fieldcam.errors import BadInput
from fieldcam.exchange.rounding import each_rounded
from fieldcam.values import FloatMap, Instance, Matcher, StereoPair, TagPose
from fieldcam.words import number_of

if TYPE_CHECKING:
    from fieldcam.values import Calibration, ImageU8
    from fieldcam.vision.stereo.matching import StereoMatcher

PIXEL_DIGITS = 2
"""To a hundredth of a pixel, which is more than anyone can measure."""


def register(commands: Subparsers[Parser]) -> None:
    tags = add_command(commands, "tags", "read the AprilTags of an image", _tags)
    tags.add_argument("image", type=Path, help="8-bit PNG, JPEG, PGM or PPM")
    tags.add_argument("--calibration", type=Path, metavar="FILE", help="to know their range")
    add_tag_size(tags)
    add_block_of_cards(tags)
    add_json(tags)

    segment = add_command(commands, "segment", "find the fruitlets of an image", _segment)
    segment.add_argument("image", type=Path, help="8-bit PNG, JPEG, PGM or PPM")
    add_json(segment)

    disparity = add_command(
        commands, "disparity", "match a rectified pair and write the disparity", _disparity
    )
    disparity.add_argument("left", type=Path, help="image of the left eye, rectified")
    disparity.add_argument("right", type=Path, help="image of the right eye, rectified")
    disparity.add_argument("out", type=Path, metavar="OUT.npy", help="float32, NaN where unknown")
    disparity.add_argument(
        "--stereo",
        type=Matcher,
        choices=list(Matcher),
        default=Matcher.RAFT,
        help="sgbm: the paper's baseline",
    )
    disparity.add_argument(
        "--max-disparity", type=positive_count, metavar="N", help="bound of the search, pixels"
    )
    add_json(disparity)


def _tags(arguments: argparse.Namespace) -> None:
    from fieldcam.exchange.images import read_image
    from fieldcam.vision.tags.detection import detect_tags
    from fieldcam.vision.tags.other_families import other_family

    image = read_image(arguments.image)
    calibration = _calibration_for(image, arguments.calibration)
    tags = detect_tags(image, calibration, tag_size_of(arguments))
    if arguments.json:
        emit_json({"tags": [_tag_entry(tag) for tag in tags]})
        return
    other = "" if tags else other_family(image)
    narrate(
        f"{number_of(len(tags), 'tag')} found." + (f" One of {other} is seen." if other else "")
    )
    rows = [["tag", "centre x", "centre y", "range mm"]]
    rows += [[str(t.id), *(f"{v:.1f}" for v in t.center_px), _text(t.range_mm, 1)] for t in tags]
    for line in table(rows, ">>>>") if tags else ():
        emit(line)


def _segment(arguments: argparse.Namespace) -> None:
    from fieldcam.exchange.images import read_image

    models = checked_models(arguments.data)
    instances = open_segmenter(models).segment(read_image(arguments.image)).instances
    narrate(models.honesty)
    if arguments.json:
        emit_json({"instances": [_instance_entry(instance) for instance in instances]})
        return
    narrate(f"{number_of(len(instances), 'fruitlet')} found.")
    rows = [["score", "area px", "x0", "y0", "x1", "y1"]]
    rows += [
        [f"{i.score:.2f}", str(i.visible.area_px), *(f"{v:.1f}" for v in i.box_px)]
        for i in instances
    ]
    for line in table(rows, ">>>>>>") if instances else ():
        emit(line)


def _disparity(arguments: argparse.Namespace) -> None:
    from fieldcam.exchange.images import read_pair
    from fieldcam.vision.stereo.matching import default_max_disparity, match_whole

    pair = StereoPair(*read_pair(arguments.left, arguments.right))
    width_px = pair.size_px[0]
    bound = arguments.max_disparity or default_max_disparity(width_px)
    if bound > max(width_px, default_max_disparity(width_px)):
        raise BadInput(f"--max-disparity {bound} is more than the images' width of {width_px} px.")
    matcher = _open_matcher(arguments)
    disparity = match_whole(pair, matcher, bound).disparity_px
    _save(arguments.out, disparity)
    known = _known_share(disparity)
    if arguments.json:
        emit_json({"out": str(arguments.out), "max_disparity": bound, "known_share": known})
    else:
        narrate(f"{arguments.out}: {known:.0%} of the pixels have a disparity of at most {bound}.")


def _open_matcher(arguments: argparse.Namespace) -> StereoMatcher:
    from fieldcam.vision.stereo.sgbm import SgbmMatcher

    if arguments.stereo is Matcher.SGBM:
        return SgbmMatcher()
    models = checked_models(arguments.data)
    narrate(models.honesty)
    return open_raft(models)


def _calibration_for(image: ImageU8, path: Path | None) -> Calibration | None:
    from fieldcam.calibration.reading.readers import load_rectified
    from fieldcam.exchange.images import check_against

    if path is None:
        return None
    calibration = load_rectified(path, (image.shape[1], image.shape[0]))
    check_against(calibration, image)
    return calibration


def _tag_entry(tag: TagPose) -> dict[str, Any]:
    return {
        "id": tag.id,
        "center_px": each_rounded(tag.center_px, PIXEL_DIGITS),
        "corners_px": [each_rounded(corner, PIXEL_DIGITS) for corner in tag.corners_px],
        "range_mm": None if tag.range_mm is None else round(tag.range_mm, 1),
    }


def _instance_entry(instance: Instance) -> dict[str, Any]:
    from fieldcam.vision.sizing.outline import pixel_outline

    return {
        "box_px": each_rounded(instance.box_px, PIXEL_DIGITS),
        "score": round(float(instance.score), 4),
        "area_px": instance.visible.area_px,
        "outline_px": pixel_outline(instance.visible).tolist(),
    }


def _save(path: Path, disparity: FloatMap) -> None:
    import numpy as np

    from fieldcam.disk.targets import write_target

    written = BytesIO()
    np.save(written, disparity)
    write_target(path, written.getvalue())


def _known_share(disparity: FloatMap) -> float:
    import numpy as np

    return float(np.isfinite(disparity).mean())


def _text(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
