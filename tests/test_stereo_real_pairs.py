"""SGBM on the Middlebury 2003 pairs: real texture, real occlusions, true disparity."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from fieldcam.values import BoolMask, StereoPair
from fieldcam.vision.sgbm import SgbmMatcher
from fieldcam.vision.stereo import match_whole

BOUND = 64


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


@pytest.mark.real
@pytest.mark.parametrize("scene", ["Cones", "Teddy"])
def test_sgbm_error_on_middlebury(real: Path, scene: str) -> None:
    truth = read(real / "stereo" / f"middlebury2003_{scene}")
    found = match_whole(truth.pair, SgbmMatcher(), BOUND).disparity_px
    error = np.abs(found - truth.disparity_px)
    given = np.isfinite(truth.disparity_px)
    clear = given & truth.in_both & (np.arange(found.shape[1]) >= BOUND)[None, :]

    assert found.shape == truth.disparity_px.shape
    assert np.nanmean(error[given]) < 0.8
    assert np.nanmean(error[clear]) < 0.65
    # Unknown counts as bad here.
    assert 1 - (error[given] <= 3).mean() < 0.20
    assert 1 - (error[clear] <= 3).mean() < 0.09


@pytest.mark.real
@pytest.mark.parametrize("bound", [32, 40])
def test_a_bound_below_the_scene_leaves_the_near_part_unknown(real: Path, bound: int) -> None:
    truth = read(real / "stereo" / "middlebury2003_Cones")
    found = match_whole(truth.pair, SgbmMatcher(), bound).disparity_px
    assert np.nanmax(found) <= bound
    beyond = truth.disparity_px > bound + 4
    assert np.isnan(found[beyond]).mean() > 0.6
