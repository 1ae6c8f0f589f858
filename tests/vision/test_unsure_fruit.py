"""What the verdict says where fruit may hang that the networks did not find."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_evidence import CAMERA, SEARCHED, evidence, judged, make_fruitlet

from fieldcam.values import DisparityWindow, Flag, ReasonCode, Status
from fieldcam.vision.judging.doubt import unsure_places

BESIDE = (880.0, 610.0)
FAR_ASIDE = (620.0, 300.0)
LOWER = ((870.0, 580.0), (900.0, 540.0))


def _flat(range_mm: float) -> DisparityWindow:
    disparity = CAMERA.disparity_px(range_mm)
    return DisparityWindow(SEARCHED, np.full((720, 720), disparity, np.float32))


def test_a_cluster_that_was_understood_is_accepted() -> None:
    assert judged(evidence()).status is Status.ACCEPT


def test_one_unsure_place_beside_three_fruitlets_is_usual() -> None:
    assert judged(evidence(faint_px=(BESIDE,))).status is Status.ACCEPT


@pytest.mark.parametrize(
    "changes",
    [
        {"faint_px": (BESIDE, (850.0, 500.0))},
        {"faint_px": (BESIDE,), "fruitlets": (make_fruitlet(),)},
        {"fruitlets": (make_fruitlet(), *(make_fruitlet(p, (Flag.BAD_OUTLINE,)) for p in LOWER))},
        {"fruitlets": (make_fruitlet(), replace(make_fruitlet((900, 540)), in_target=False))},
    ],
    ids=["faint", "faint beside one", "too unsure to be sized", "of no cluster"],
)  # fmt: skip
def test_much_that_may_be_fruit_is_asked_about(changes: dict[str, object]) -> None:
    verdict = judged(evidence(**changes))
    assert verdict.status is Status.CONFIRM
    reasons = [r for r in verdict.reasons if r.code is ReasonCode.UNSURE_FRUIT]
    assert len(reasons) == 1
    assert "beside the tag may be fruit" in reasons[0].text


def test_what_hangs_elsewhere_is_no_doubt_about_this_cluster() -> None:
    assert unsure_places(evidence(faint_px=(FAR_ASIDE,))) == ()
    behind = evidence(faint_px=(BESIDE,), window=_flat(520.0))
    assert unsure_places(behind) == ()


def test_a_place_of_unknown_range_may_belong_to_the_cluster() -> None:
    nothing = DisparityWindow(SEARCHED, np.full((720, 720), np.nan, np.float32))
    assert unsure_places(evidence(faint_px=(BESIDE,), window=nothing)) == (BESIDE,)


def test_a_spoiled_picture_is_not_asked_about_its_fruit() -> None:
    verdict = judged(evidence(faint_px=(BESIDE, BESIDE), tag_blur_px=9.0))
    assert verdict.status is Status.RETAKE
    assert ReasonCode.UNSURE_FRUIT not in [r.code for r in verdict.reasons]
