"""`fieldcam size`: one stereo pair in, diameters out."""

from __future__ import annotations

import argparse
from pathlib import Path

from fieldcam.cli.arguments import (
    Parser,
    Subparsers,
    add_command,
    add_json,
    count,
    tag_id,
)
from fieldcam.cli.card_size import add_block_of_cards, add_tag_size, tag_size_of
from fieldcam.cli.console import emit, emit_json, narrate, table
from fieldcam.cli.networks import checked_models
from fieldcam.models import Models
from fieldcam.values import (
    Calibration,
    ClusterReading,
    Expectation,
    Flag,
    Fruitlet,
    Matcher,
    Method,
    Settings,
    StereoPair,
)


def register(commands: Subparsers[Parser]) -> None:
    size = add_command(commands, "size", "size the fruitlets of one stereo pair", _size)
    size.add_argument("left", type=Path, help="image of the left eye")
    size.add_argument("right", type=Path, help="image of the right eye")
    size.add_argument(
        "--calibration",
        type=Path,
        required=True,
        metavar="FILE",
        help="of this camera; see --rectify",
    )
    size.add_argument(
        "--rectify", action="store_true", help="the images are raw: rectify them first"
    )
    size.add_argument("--tag", type=tag_id, metavar="ID", help="the tag that is expected here")
    add_tag_size(size)
    add_block_of_cards(size)
    size.add_argument(
        "--expect", type=count, metavar="N", help="how many fruitlets were counted last visit"
    )
    size.add_argument(
        "--method",
        type=Method,
        choices=list(Method),
        default=Method.DEFAULT,
        help="paper: its recipe",
    )
    size.add_argument(
        "--stereo",
        type=Matcher,
        choices=list(Matcher),
        default=Matcher.RAFT,
        help="sgbm: the paper's baseline",
    )
    size.add_argument("--whole-image", action="store_true", help="search beyond the tag's region")
    size.add_argument("--overlay", type=Path, metavar="PNG", help="write a picture of the result")
    add_json(size)


def _size(arguments: argparse.Namespace) -> None:
    from fieldcam.exchange.images import check_png_target, write_png
    from fieldcam.exchange.reading_report import reading_report
    from fieldcam.report.overlay import draw_overlay
    from fieldcam.vision.pipeline import Pipeline

    if arguments.overlay is not None:
        check_png_target(arguments.overlay)
    pair, calibration = _load(arguments)
    models = checked_models(arguments.data)
    settings = Settings(
        arguments.method, arguments.stereo, arguments.whole_image, tag_size_of(arguments)
    )
    expectation = Expectation(arguments.tag, arguments.expect)
    reading = Pipeline.from_models(models).analyse(pair, calibration, expectation, settings)
    if arguments.overlay is not None:
        write_png(arguments.overlay, draw_overlay(pair.left, reading, False, models.honesty))
    if arguments.json:
        narrate(models.honesty)
        emit_json(reading_report(reading))
    else:
        _print(reading, models)


def _load(arguments: argparse.Namespace) -> tuple[StereoPair, Calibration]:
    """The rectified pair and its camera."""
    from fieldcam.calibration.reading.readers import load_rectified, load_stereo_rig
    from fieldcam.calibration.rectification import Rectifier
    from fieldcam.exchange.holes import torn_eyes
    from fieldcam.exchange.images import check_against, read_pair

    left, right = read_pair(arguments.left, arguments.right)
    files = {"left": (arguments.left, left), "right": (arguments.right, right)}
    pair = StereoPair(left, right, torn_eyes(files))
    if arguments.rectify:
        rig = load_stereo_rig(arguments.calibration, pair.size_px)
        return Rectifier(rig).rectify(pair), rig.rectified
    calibration = load_rectified(arguments.calibration, pair.size_px)
    check_against(calibration, pair.left)
    return pair, calibration


def _print(reading: ClusterReading, models: Models) -> None:
    for line in reading_lines(reading):
        emit(line)
    emit("")
    emit(models.honesty)


def reading_lines(reading: ClusterReading) -> list[str]:
    """A reading as a person wants to see it."""
    tag = reading.tag
    where = "no tag" if tag is None else f"tag {tag.id}"
    if tag is not None and tag.range_mm is not None:
        where += f" at {tag.range_mm:.0f} mm"
    lines = [f"{reading.verdict.status.upper()}  {where}"]
    lines += [f"  {reason.text}" for reason in reading.verdict.reasons]
    if reading.target:
        rows = [["fruitlet", "diameter mm", "±", "visible", "range mm", "note"]]
        rows += [_row(fruitlet) for fruitlet in reading.target]
        lines += ["", *table(rows, ">>>>><")]
    others = [f for f in reading.fruitlets if not f.in_target]
    lost = sum(Flag.NO_DEPTH in f.flags for f in others)
    if len(others) > lost:
        lines.append(f"{len(others) - lost} more outside the tagged cluster.")
    if lost:
        lines.append(f"{lost} more without depth: whose they are is not known.")
    return lines


def _row(fruitlet: Fruitlet) -> list[str]:
    return [
        str(fruitlet.id),
        "-" if fruitlet.diameter_mm is None else f"{fruitlet.diameter_mm:.2f}",
        "" if fruitlet.sd_mm is None else f"{fruitlet.sd_mm:.2f}",
        f"{fruitlet.visible_fraction:.0%}",
        "-" if fruitlet.range_mm is None else f"{fruitlet.range_mm:.0f}",
        ", ".join(str(flag).replace("_", " ") for flag in fruitlet.flags),
    ]
