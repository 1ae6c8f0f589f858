"""What the verdict's thresholds rest on: good pairs, spoiled in image space, and photographs.

`python -m export.tune_verdict [--folder DIR] [--spoiled N] [--sized N]` prints, for
each measure of the verdict, its spread on good pairs, on photographs and at each
strength of each degradation, with the share beyond the threshold in use. With
`--sized N` it also sizes N pairs at each strength, to show where sizes go wrong.
The simulator's own faults take no part.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from export.render_orchard import TUNING, render_tuning
from fieldcam.calibration.drift import (
    DRIFT_SIZE,
    row_disagreement_px,
    size_off,
    tag_disparity_px,
    tag_size_error,
)
from fieldcam.calibration.reading.readers import load_rectified
from fieldcam.exchange.images import read_image, read_pair
from fieldcam.images.grey import as_grey
from fieldcam.models import find_models
from fieldcam.values import (
    FARTHEST_MM,
    NEAREST_MM,
    Calibration,
    Expectation,
    ImageU8,
    StereoPair,
)
from fieldcam.vision.judging import eyes, verdicts
from fieldcam.vision.judging.eye_matches import match_eyes
from fieldcam.vision.judging.quality import LIT, clipped_share, middle, white_level
from fieldcam.vision.judging.sharpness import edge_blur_px, tag_blur_px
from fieldcam.vision.pipeline import Pipeline
from fieldcam.vision.regions import around_tag
from fieldcam.vision.tags.detection import choose_tag, detect_tags
from fieldcam.vision.tags.right_eye import find_in_right

PHOTOGRAPHS = Path("../shared/real")
TONE = 2.0
"""Gamma that is undone and redone around a change of exposure."""
QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)

Measures = dict[str, float]
Edit = Callable[[StereoPair, StereoPair], StereoPair]
"""Spoils a pair; the second one is a pair of another cluster."""


@dataclass(frozen=True, slots=True, eq=False)
class GoodPair:
    """A good pair of the tuning set with what is known about it."""

    pair: StereoPair
    calibration: Calibration
    tag_id: int
    fruit: npt.NDArray[np.bool_]
    """(H, W) visible fruit."""
    diameters_mm: dict[tuple[float, float], float]
    """True sizes of the target's well visible fruitlets by their centres in px."""


BEYOND: dict[str, Callable[[float], bool]] = {
    "fruit_brightness": lambda v: v < verdicts.MIN_FRUIT_BRIGHTNESS,
    "white_level": lambda v: v < verdicts.MIN_WHITE_LEVEL,
    "fruit_clipped": lambda v: v > verdicts.MAX_CLIPPED,
    "around_clipped": lambda v: v > verdicts.MAX_CLIPPED_AROUND,
    "tag_blur_px": lambda v: v > verdicts.MAX_TAG_BLUR_PX,
    "edge_blur_px": lambda v: v > verdicts.MAX_EDGE_BLUR_PX,
    "tag_rows_px": lambda v: v > eyes.DRIFT_ROWS_PX,
    "tag_size_off": lambda v: v > DRIFT_SIZE,
    "tag_disparity_px": lambda v: v < 0,
    "found_share": lambda v: v < eyes.MIN_FOUND,
    "swapped_share": lambda v: v > eyes.SWAPPED_SHARE,
    "spots_rows_px": lambda v: v > eyes.BAD_DRIFT_ROWS_PX,
    "spots_spread_px": lambda v: v > eyes.MISPAIRED_SPREAD_PX,
    "nearer_is_farther_off": lambda v: v > 0.5,
    "right_white_ratio": lambda v: v < verdicts.MIN_RIGHT_WHITE_RATIO,
    "tag_range_mm": lambda v: not NEAREST_MM <= v <= FARTHEST_MM,
}
"""For each measure: whether a value speaks against the pair."""


def degradations() -> Iterator[tuple[str, Edit]]:
    """Every way of spoiling a good pair, by its name and strength."""
    for gain in (1 / 4, 1 / 8, 1 / 16, 1 / 32, 1 / 64, 2.0, 3.0, 4.0, 6.0, 9.0):
        yield f"exposure x{gain:.3g}", _on_both(partial(exposed, gain=gain))
    for sigma in (1.0, 1.5, 2.0, 2.5, 3.5, 5.0):
        yield f"soft {sigma} px", _on_both(partial(soft, sigma_px=sigma))
    for length in (4.0, 6.0, 9.0, 13.0, 20.0):
        for degrees in (0, 50):
            edit = partial(smeared, length_px=length, angle_rad=np.deg2rad(degrees))
            yield f"smeared {length:g} px at {degrees} degrees", _on_both(edit)
    yield "noise 8", _on_both(noisy)
    for rows in (0.8, 1.5, 2.5, 5.0):
        yield f"right eye {rows} px lower", _on_right(partial(lowered, rows_px=rows))
    for shift in ((5, 4), (-14, 10), (30, -20)):
        yield f"right eye moved by {shift}", _on_right(partial(rolled, shift_px=shift))
    yield "eyes swapped", lambda pair, _: StereoPair(pair.right, pair.left)
    yield "right eye of another tree", lambda pair, other: StereoPair(pair.left, other.right)
    yield "right eye at x0.1 light", _on_right(partial(exposed, gain=0.1))
    for factor in (0.6, 1.6):
        yield f"scaled x{factor}", _on_both(partial(scaled, factor=factor))


def exposed(image: ImageU8, gain: float) -> ImageU8:
    """The picture at another exposure; read noise stays when light goes."""
    light = (image.astype(np.float32) / 255) ** TONE * gain
    light += np.random.default_rng(1).normal(0, 0.0015, light.shape) * (gain < 1)
    return np.asarray(np.rint(np.clip(light, 0, 1) ** (1 / TONE) * 255), np.uint8)


def soft(image: ImageU8, sigma_px: float) -> ImageU8:
    return grainy(np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), np.uint8))


def smeared(image: ImageU8, length_px: float, angle_rad: float) -> ImageU8:
    """Averaged along a straight path."""
    side = 2 * int(np.ceil(length_px / 2)) + 3
    path = np.zeros((side, side), np.float32)
    for step in np.linspace(-0.5, 0.5, 8 * side) * length_px:
        x, y = (side // 2 + step * f(angle_rad) for f in (np.cos, np.sin))
        path[round(y), round(x)] += 1
    return grainy(np.asarray(cv2.filter2D(image, -1, path / path.sum()), np.uint8))


def grainy(image: ImageU8) -> ImageU8:
    """With the noise of a sensor, which no blur softens: strongest in the dark."""
    light = (image.astype(np.float32) / 255) ** TONE
    grain = np.random.default_rng(1).standard_normal(light.shape, np.float32)
    light += grain * np.sqrt(0.001 * light + 0.006**2)
    return np.asarray(np.rint(np.clip(light, 0, 1) ** (1 / TONE) * 255), np.uint8)


def noisy(image: ImageU8) -> ImageU8:
    noise = np.random.default_rng(1).normal(0, 8, image.shape)
    return np.asarray(np.clip(np.rint(image + noise), 0, 255), np.uint8)


def lowered(image: ImageU8, rows_px: float) -> ImageU8:
    matrix = np.array([[1, 0, 0], [0, 1, rows_px]], np.float32)
    size = (image.shape[1], image.shape[0])
    return np.asarray(cv2.warpAffine(image, matrix, size, flags=cv2.INTER_CUBIC), np.uint8)


def rolled(image: ImageU8, shift_px: tuple[int, int]) -> ImageU8:
    return np.roll(image, shift_px, axis=(1, 0))


def scaled(image: ImageU8, factor: float) -> ImageU8:
    """About the image's middle, as from nearer or farther."""
    height, width = image.shape[:2]
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0, factor)
    return np.asarray(cv2.warpAffine(image, matrix, (width, height), flags=cv2.INTER_AREA), "u1")


def _on_both(edit: Callable[[ImageU8], ImageU8]) -> Edit:
    return lambda pair, _: StereoPair(edit(pair.left), edit(pair.right))


def _on_right(edit: Callable[[ImageU8], ImageU8]) -> Edit:
    return lambda pair, _: StereoPair(pair.left, edit(pair.right))


def measures(
    pair: StereoPair, calibration: Calibration, tag_id: int, fruit: npt.NDArray[np.bool_]
) -> Measures:
    """The verdict's measures, with the true fruit in place of the found one."""
    left, right = as_grey(pair.left), as_grey(pair.right)
    tag = choose_tag(detect_tags(left, calibration), tag_id, pair.size_px)
    region = middle(*pair.size_px)
    found: Measures = {"tag_read": float(tag is not None)}
    if tag is not None:
        region = around_tag(tag, calibration, *pair.size_px)
        found["tag_blur_px"] = tag_blur_px(left, tag) or np.nan
        found["tag_range_mm"] = tag.range_mm or np.nan
        other = find_in_right(detect_tags, right, tag, calibration)
        found["right_tag_read"] = float(other is not None)
        if other is not None:
            found["tag_size_off"] = size_off(tag_size_error((tag, other), calibration))
            found["tag_rows_px"] = row_disagreement_px((tag, other))
            found["tag_disparity_px"] = tag_disparity_px((tag, other))
    matches = match_eyes(left, right, region)
    around = left[region.slices]
    found |= {
        "fruit_brightness": float(np.median(left[fruit])),
        "fruit_clipped": clipped_share(left[fruit]),
        "white_level": white_level(around),
        "around_clipped": clipped_share(around[around >= LIT]),
        "right_white_ratio": white_level(right) / max(white_level(left), 1.0),
        "edge_blur_px": edge_blur_px(around) or np.nan,
        "found_share": matches.found_share,
        "swapped_share": matches.swapped_share,
        "spots_rows_px": np.nan if matches.rows_px is None else abs(matches.rows_px),
        "spots_spread_px": np.nan if matches.rows_spread_px is None else matches.rows_spread_px,
        "nearer_is_farther_off": float(matches.nearer_is_farther_off),
    }
    return found


def photograph_measures(folder: Path) -> Iterator[Measures]:
    """What one eye alone tells, from photographs of apples and of tags."""
    for path in sorted([*folder.glob("apples_green/images/*"), *folder.glob("apriltag/*/*.jpg")]):
        grey = as_grey(read_image(path))
        inside = grey[middle(grey.shape[1], grey.shape[0]).slices]
        yield {
            "white_level": white_level(inside),
            "around_clipped": clipped_share(inside[inside >= LIT]),
            "edge_blur_px": edge_blur_px(inside) or np.nan,
        }
        for tag in detect_tags(grey):
            yield {"tag_blur_px": tag_blur_px(grey, tag) or np.nan}


def load_good(folder: Path) -> GoodPair:
    truth = json.loads((folder / "truth.json").read_text())
    pair = StereoPair(*read_pair(folder / "left.png", folder / "right.png"))
    window = np.load(folder / "disparity.npz")
    fruit = np.zeros(pair.left.shape[:2], bool)
    rows, columns = window["fruit"].shape
    y0, x0 = int(window["y0"]), int(window["x0"])
    fruit[y0 : y0 + rows, x0 : x0 + columns] = window["fruit"] > 0
    known = {
        tuple(f["center_px"]): f["diameter_mm"]
        for f in truth["fruitlets"]
        if f["in_target"] and f["visible_fraction"] > 0.8
    }
    return GoodPair(pair, load_rectified(folder / "calibration.yml"), truth["tag"], fruit, known)


def size_errors_mm(pipeline: Pipeline, good: GoodPair, pair: StereoPair) -> list[float]:
    """Errors of the well visible fruitlets' sizes; NaN where there is none."""
    reading = pipeline.analyse(pair, good.calibration, Expectation(good.tag_id))
    sized = [(f.center_px, f.diameter_mm) for f in reading.fruitlets if f.diameter_mm is not None]
    errors = []
    for center, diameter_mm in good.diameters_mm.items():
        near = [(float(np.hypot(c[0] - center[0], c[1] - center[1])), d) for c, d in sized]
        distance_px, found_mm = min(near, default=(np.inf, np.nan))
        errors.append(found_mm - diameter_mm if distance_px < 15 else np.nan)
    return errors


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--folder", type=Path, default=TUNING)
    parser.add_argument("--photographs", type=Path, default=PHOTOGRAPHS)
    parser.add_argument("--spoiled", type=int, default=8, help="pairs to spoil")
    parser.add_argument("--sized", type=int, default=0, help="pairs to size at each strength")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    if arguments.folder == TUNING:
        render_tuning()
    folders = sorted(p.parent for p in arguments.folder.glob("*/truth.json"))
    measured: dict[str, list[Measures]] = defaultdict(list)
    measured["photographs"] = list(photograph_measures(arguments.photographs))
    others = load_good(folders[-1]).pair
    step = max(1, len(folders) // max(arguments.spoiled, 1))
    for number, folder in enumerate(folders):
        good = load_good(folder)
        rest = (good.calibration, good.tag_id, good.fruit)
        measured["good"].append(measures(good.pair, *rest))
        if number % step == 0 and folder != folders[-1]:
            for name, edit in degradations():
                measured[name].append(measures(edit(good.pair, others), *rest))
    for measure in ("tag_read", "right_tag_read", *BEYOND):
        _print_measure(measure, measured)
    if arguments.sized:
        _print_sizes([load_good(f) for f in folders[:: len(folders) // arguments.sized]], others)


def _print_measure(measure: str, measured: dict[str, list[Measures]]) -> None:
    print(f"\n### {measure}\n")
    print("| pairs | n | least | 5 % | median | 95 % | most | beyond |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    beyond = BEYOND.get(measure, _is_missing)
    for name in ("good", "photographs", *(n for n in measured if n not in ("good", "photographs"))):
        values = np.array([m[measure] for m in measured[name] if measure in m])
        values = values[np.isfinite(values)]
        if values.size:
            spread = " | ".join(f"{q:.3g}" for q in np.quantile(values, QUANTILES))
            share = np.mean([beyond(float(v)) for v in values])
            print(f"| {name} | {values.size} | {spread} | {share:.0%} |")


def _is_missing(share_read: float) -> bool:
    return share_read < 0.5


def _as_it_is(pair: StereoPair, _other: StereoPair) -> StereoPair:
    return pair


def _print_sizes(goods: list[GoodPair], other: StereoPair) -> None:
    print("\n### sizes of well visible fruitlets\n")
    print("| pairs | fruitlets | sized | mean absolute error mm | bias mm |")
    print("| --- | ---: | ---: | ---: | ---: |")
    pipeline = Pipeline.from_models(find_models())
    for name, edit in (("good", _as_it_is), *degradations()):
        if name.startswith(("scaled", "eyes swapped", "right eye of")):
            continue
        errors = np.array(
            [e for g in goods for e in size_errors_mm(pipeline, g, edit(g.pair, other))]
        )
        known = errors[np.isfinite(errors)]
        mean = np.abs(known).mean() if known.size else np.nan
        bias = known.mean() if known.size else np.nan
        share = known.size / errors.size
        print(f"| {name} | {errors.size} | {share:.0%} | {mean:.2f} | {bias:+.2f} |")


if __name__ == "__main__":
    main()
