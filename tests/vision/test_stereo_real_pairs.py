"""Both matchers on the Middlebury 2003 pairs: real texture, real occlusions, true disparity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from fieldcam.cli.networks import checked_models, open_raft
from fieldcam.values import BoolMask, FloatMap, Matcher, StereoPair
from fieldcam.vision.stereo.matching import StereoMatcher, match_whole
from fieldcam.vision.stereo.sgbm import SgbmMatcher

BOUND = 64
# Error in px, share over 3 px or unknown: of all pixels with truth, then of those
# that both eyes see, right of the search border. Measured on the worse pair:
# SGBM 0.66 and 16.2 %, 0.53 and 7.5 %; the network 0.77 and 14.5 %, 0.62 and 6.0 %.
LIMITS = {
    Matcher.SGBM: ((0.80, 0.20), (0.65, 0.09)),
    Matcher.RAFT: ((0.85, 0.155), (0.70, 0.07)),
}


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """A pair with its true disparity in px (NaN unknown) and what both eyes see."""

    pair: StereoPair
    disparity_px: npt.NDArray[np.float64]
    in_both: BoolMask


def read(folder: Path) -> Truth:
    left, right = (_image(folder / name) for name in ("im2.png", "im6.png"))
    stored = np.asarray(cv2.imread(str(folder / "disp2.png"), cv2.IMREAD_GRAYSCALE), np.float64)
    occluded = np.asarray(cv2.imread(str(folder / "occl.png"), cv2.IMREAD_GRAYSCALE))
    disparity = np.where(stored > 0, stored / 4, np.nan)
    return Truth(StereoPair(left, right), disparity, occluded == 255)


def _image(path: Path) -> npt.NDArray[np.uint8]:
    bgr = np.asarray(cv2.imread(str(path)), np.uint8)
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), np.uint8)


@dataclass(frozen=True, slots=True)
class Accuracy:
    """End-point error in px of the known pixels, and what is over 3 px or unknown of all."""

    error_px: float
    over_share: float
    unknown_share: float

    @classmethod
    def of(cls, found: FloatMap, truth: Truth, pixels: BoolMask) -> Accuracy:
        error = np.abs(found - truth.disparity_px)[pixels]
        return cls(
            float(np.nanmean(error)), float((error > 3).mean()), float(np.isnan(error).mean())
        )

    def __str__(self) -> str:
        return (
            f"error {self.error_px:.2f} px, {self.over_share:.1%} over 3 px, "
            f"{self.unknown_share:.1%} unknown"
        )

    def within(self, error_px: float, bad_share: float) -> bool:
        """Unknown counts as bad, so that saying nothing improves one figure only."""
        return self.error_px < error_px and self.over_share + self.unknown_share < bad_share


def matcher(name: Matcher, no_data: Path) -> StereoMatcher:
    return SgbmMatcher() if name is Matcher.SGBM else open_raft(checked_models(no_data))


@pytest.mark.real
@pytest.mark.parametrize("scene", ["Cones", "Teddy"])
@pytest.mark.parametrize("name", Matcher)
def test_error_on_middlebury(
    real: Path, name: Matcher, scene: str, tmp_path: Path, note: Callable[[str], None]
) -> None:
    truth = read(real / "stereo" / f"middlebury2003_{scene}")
    found = match_whole(truth.pair, matcher(name, tmp_path), BOUND).disparity_px
    given = np.isfinite(truth.disparity_px)
    clear = given & truth.in_both & (np.arange(found.shape[1]) >= BOUND)[None, :]
    everywhere, in_both = (Accuracy.of(found, truth, pixels) for pixels in (given, clear))
    note(f"Middlebury {scene}, {name}: all pixels {everywhere}; seen by both eyes {in_both}")

    assert found.shape == truth.disparity_px.shape
    assert everywhere.within(*LIMITS[name][0])
    assert in_both.within(*LIMITS[name][1])


@pytest.mark.real
@pytest.mark.parametrize("scene", ["Cones", "Teddy"])
def test_the_network_knows_more_of_a_real_scene_than_sgbm(
    real: Path, scene: str, tmp_path: Path
) -> None:
    truth = read(real / "stereo" / f"middlebury2003_{scene}")
    given = np.isfinite(truth.disparity_px)
    wrong = {}
    for name in Matcher:
        found = match_whole(truth.pair, matcher(name, tmp_path), BOUND).disparity_px
        accuracy = Accuracy.of(found, truth, given)
        wrong[name] = accuracy.over_share + accuracy.unknown_share
    assert wrong[Matcher.RAFT] < wrong[Matcher.SGBM]


@pytest.mark.real
@pytest.mark.parametrize("bound", [32, 40])
def test_a_bound_below_the_scene_leaves_the_near_part_unknown(real: Path, bound: int) -> None:
    truth = read(real / "stereo" / "middlebury2003_Cones")
    found = match_whole(truth.pair, SgbmMatcher(), bound).disparity_px
    assert np.nanmax(found) <= bound
    beyond = truth.disparity_px > bound + 4
    assert np.isnan(found[beyond]).mean() > 0.6
