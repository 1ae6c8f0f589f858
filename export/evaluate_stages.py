"""How good masks and disparity are on rendered pairs that nothing was trained on.

`python -m export.evaluate_stages [--folder DIR]` runs the shipped networks as
`fieldcam size` does and prints a Markdown table: mask IoU of the found fruitlets,
and disparity error on fruitlets' pixels that both eyes see, for both matchers.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from export.evaluate import VALIDATION, read_truth
from fieldcam.calibration.reading.readers import load_rectified
from fieldcam.exchange.images import read_pair
from fieldcam.models import find_models
from fieldcam.values import (
    ClusterReading,
    Expectation,
    Mask,
    Matcher,
    Region,
    Settings,
    StereoPair,
)
from fieldcam.vision.pipeline import Pipeline

MIN_VISIBLE_PX = 60
FOUND_IOU = 0.5
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PixelTruth:
    """What is really there in the window around a target."""

    region: Region
    disparity_px: npt.NDArray[np.float32]
    matched: npt.NDArray[np.bool_]
    """The other eye sees it too."""
    fruit: npt.NDArray[np.integer]
    """0 none, k the visible pixels of fruitlet k - 1."""

    @classmethod
    def load(cls, folder: Path) -> PixelTruth:
        with np.load(folder / "disparity.npz") as saved:
            x0, y0 = int(saved["x0"]), int(saved["y0"])
            height, width = saved["fruit"].shape
            return cls(
                Region(x0, y0, x0 + width, y0 + height),
                saved["disparity_px"], saved["matched"], saved["fruit"],
            )  # fmt: skip

    def shown_by(self, mask: Mask) -> npt.NDArray[np.bool_]:
        """The mask's pixels over this window."""
        height, width = self.region.height, self.region.width
        shown = np.zeros((height, width), np.bool_)
        rows, columns = np.nonzero(mask.window)
        rows, columns = rows + mask.y0 - self.region.y0, columns + mask.x0 - self.region.x0
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        shown[rows[inside], columns[inside]] = True
        return shown


def mask_ious(reading: ClusterReading, truth: PixelTruth) -> Iterator[float]:
    """Best overlap of each true fruitlet with a found one, 0 to 1."""
    shown = [truth.shown_by(fruitlet.mask) for fruitlet in reading.fruitlets]
    for k in range(1, int(truth.fruit.max(initial=0)) + 1):
        true = truth.fruit == k
        if true.sum() >= MIN_VISIBLE_PX:
            yield max((float((s & true).sum() / (s | true).sum()) for s in shown), default=0.0)


def disparity_errors(reading: ClusterReading, truth: PixelTruth) -> Floats:
    """Signed errors in px on fruitlets' pixels that both eyes see; NaN where unknown."""
    assert reading.window is not None
    found = reading.window.over(truth.region)
    chosen = (truth.fruit > 0) & truth.matched
    return np.asarray((found - truth.disparity_px)[chosen], np.float64)


def table(ious: Floats, errors: dict[Matcher, Floats]) -> Iterator[str]:
    """Markdown."""
    found = ious[ious >= FOUND_IOU]
    yield "| measure | value |"
    yield "| --- | ---: |"
    yield f"| fruitlets with a mask at IoU >= {FOUND_IOU} | {found.size / ious.size:.1%} |"
    yield f"| IoU of these masks, median | {np.median(found):.3f} |"
    for matcher, each in errors.items():
        known = each[np.isfinite(each)]
        yield f"| disparity error on fruit, {matcher}, median | {np.median(np.abs(known)):.2f} px |"
        yield f"| its bias (median of the signed error) | {np.median(known):+.2f} px |"
        yield f"| over 3 px | {(np.abs(known) > 3).mean():.1%} |"
        yield f"| unknown | {1 - known.size / each.size:.1%} |"


def measure(folders: Sequence[Path]) -> tuple[Floats, dict[Matcher, Floats]]:
    pipeline = Pipeline.from_models(find_models())
    ious: list[float] = []
    errors: dict[Matcher, list[Floats]] = {matcher: [] for matcher in Matcher}
    for number, folder in enumerate(folders, 1):
        sys.stderr.write(f"stages: {number} of {len(folders)}\n")
        pair = StereoPair(*read_pair(folder / "left.png", folder / "right.png"))
        camera, truth = load_rectified(folder / "calibration.yml"), PixelTruth.load(folder)
        expected = Expectation(read_truth(folder)["tag"])
        for matcher in Matcher:
            reading = pipeline.analyse(pair, camera, expected, Settings(stereo=matcher))
            if reading.tag is None or reading.window is None:
                continue
            errors[matcher].append(disparity_errors(reading, truth))
            if matcher is Matcher.RAFT:
                ious += mask_ious(reading, truth)
    return np.array(ious), {m: np.concatenate(e) for m, e in errors.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--folder", type=Path, default=VALIDATION)
    folder = parser.parse_args().folder
    folders = sorted(p.parent for p in folder.glob("*/truth.json"))
    if not folders:
        raise SystemExit(f"There are no rendered pairs in {folder}; run export.evaluate first.")
    sys.stdout.write(f"{len(folders)} rendered pairs of {folder}\n\n")
    sys.stdout.write("\n".join(table(*measure(folders))) + "\n")


if __name__ == "__main__":
    main()
