"""What the verdict says about light, sharpness, tags, eyes and fruit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from made_evidence import (
    CAMERA,
    GAMMA_BIAS,
    UNREAD,
    codes,
    evidence,
    in_right,
    judged,
    make_fruitlet,
    make_tag,
    spots,
)

from fieldcam.values import (
    Calibration,
    Expectation,
    Flag,
    Status,
)
from fieldcam.vision.judging.eye_matches import EyeMatches

HALF_SIZE = Calibration(1440, 1080, 858.5, 719.5, 539.5, 60.0)
"""As with 2 x 2 pixels binned: 1.95 pixels a mm at 440 mm."""


def test_a_good_pair_is_accepted() -> None:
    verdict = judged(evidence())
    assert verdict.status is Status.ACCEPT
    assert verdict.reasons == ()


CASES: list[tuple[str, dict[str, Any], Status, set[str]]] = [
    ("dark fruit", {"fruit_brightness": 35.0}, Status.RETAKE, {"too_dark"}),
    ("dim fruit", {"fruit_brightness": 65.0}, Status.ACCEPT, set()),
    ("one eye dark", {"right_white_ratio": 0.2}, Status.RETAKE, {"too_dark"}),
    (
        "all dark", UNREAD | {"fruit_brightness": None, "white_level": 20.0, "fruitlets": ()},
        Status.RETAKE, {"too_dark", "no_tag"},
    ),
    ("clipped fruit", {"clipped_share": 0.6}, Status.RETAKE, {"overexposed"}),
    ("a glint", {"clipped_share": 0.1}, Status.ACCEPT, set()),
    (
        "white-out",
        UNREAD | {"fruit_brightness": None, "clipped_share": 0.5, "fruitlets": ()},
        Status.RETAKE, {"overexposed", "no_tag"},
    ),
    ("blurred tag", {"tag_blur_px": 3.0}, Status.RETAKE, {"blurred"}),
    ("soft edges but a sharp tag", {"edge_blur_px": 2.5}, Status.ACCEPT, set()),
    ("unread and blurred", UNREAD | {"edge_blur_px": 2.6}, Status.RETAKE, {"blurred", "no_tag"}),
    ("unread, sharp", UNREAD, Status.RETAKE, {"no_tag"}),
    ("wrong tag", {"expectation": Expectation(5, 3)}, Status.RETAKE, {"wrong_tag"}),
    (
        "two tags, none due",
        {"expectation": Expectation(None, 3), "tags_seen": (make_tag(), make_tag(tag_id=4))},
        Status.CONFIRM, {"several_tags"},
    ),
    (
        "two tags, one due", {"tags_seen": (make_tag(), make_tag(tag_id=4))},
        Status.ACCEPT, set(),
    ),
    (
        "the due tag twice", {"tags_seen": (make_tag(), make_tag(60.0))},
        Status.CONFIRM, {"several_tags"},
    ),
    (
        "unread, without an edge", UNREAD | {"edge_blur_px": float("inf")},
        Status.RETAKE, {"blurred", "no_tag"},
    ),
    ("near", {"tag": make_tag(z_mm=250.0)}, Status.RETAKE, {"too_near"}),
    ("far", {"tag": make_tag(z_mm=700.0)}, Status.RETAKE, {"too_far"}),
    ("fewer", {"expectation": Expectation(17, 5)}, Status.CONFIRM, {"fewer_than_before"}),
    ("more", {"expectation": Expectation(17, 2)}, Status.ACCEPT, set()),
    ("no fruit", {"fruitlets": (), "fruit_brightness": None}, Status.RETAKE, {"no_fruitlets"}),
    (
        "fruit without depth",
        {"fruitlets": (make_fruitlet(in_target=False),), "depth_share": 0.1},
        Status.RETAKE, {"no_depth"},
    ),
    (
        "a target without depth",
        {
            "fruitlets": (make_fruitlet(flags=(Flag.NO_DEPTH,)),),
            "expectation": Expectation(17),
        },
        Status.RETAKE, {"no_depth"},
    ),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "status", "wanted"), [c[1:] for c in CASES],
                         ids=[c[0] for c in CASES])  # fmt: skip
def test_each_finding_has_its_reason(
    changes: dict[str, Any], status: Status, wanted: set[str]
) -> None:
    found = evidence(**changes)
    assert judged(found).status is status
    assert codes(found) == wanted


def test_a_picture_that_is_too_coarse_says_so() -> None:
    coarse = [
        r.text for r in judged(evidence(calibration=HALF_SIZE)).reasons if r.code == "too_coarse"
    ]
    assert coarse == ["Too coarse: 2.0 of 2.7 pixels a mm. Go nearer, or switch binning off."]
    near = evidence(calibration=HALF_SIZE, tag=make_tag(z_mm=310.0))
    assert "too_coarse" not in codes(near)
    assert "too_coarse" not in codes(evidence(tag=make_tag(z_mm=595.0)))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "aim at it, turn it to the camera, clear leaves"),
        ({"edge_blur_px": 9.0}, "No tag could be read in it."),
        ({"other_family": "tag25h9"}, "A tag of tag25h9 is in view"),
        ({"other_family": "tag25h9", "edge_blur_px": 9.0}, "No tag could be read in it."),
    ],
)
def test_a_tag_that_was_not_read_is_told_by_its_cause(changes: dict[str, Any], words: str) -> None:
    (text,) = [r.text for r in judged(evidence(**UNREAD | changes)).reasons if r.code == "no_tag"]
    assert words in text


@pytest.mark.parametrize(
    ("rows_px", "wider", "status", "wanted"),
    [
        (0.3, GAMMA_BIAS, Status.ACCEPT, set()),
        (0.0, GAMMA_BIAS + 0.012, Status.ACCEPT, set()),
        (1.6, GAMMA_BIAS, Status.CONFIRM, {"calibration_drift"}),
        (-3.5, GAMMA_BIAS, Status.RETAKE, {"calibration_drift"}),
        (0.0, GAMMA_BIAS + 0.025, Status.CONFIRM, {"calibration_drift"}),
        (0.0, GAMMA_BIAS + 0.04, Status.RETAKE, {"calibration_drift"}),
        (0.0, GAMMA_BIAS - 0.025, Status.ACCEPT, set()),
        (15.0, GAMMA_BIAS, Status.RETAKE, {"mispaired"}),
        (0.0, 0.2, Status.RETAKE, {"mispaired"}),
        (4.0, 0.04, Status.RETAKE, {"mispaired"}),
        (0.0, -1.9, Status.RETAKE, {"swapped_eyes"}),
    ],
)
def test_the_tag_in_both_eyes_tells_drift_from_another_moment(
    rows_px: float, wider: float, status: Status, wanted: set[str]
) -> None:
    found = evidence(right_tag=in_right(make_tag(), rows_px, wider))
    assert judged(found).status is status
    assert codes(found) == wanted


@pytest.mark.parametrize("z_mm", [250.0, 700.0])
def test_out_of_range_a_tags_corners_prove_no_drift(z_mm: float) -> None:
    tag = make_tag(z_mm=z_mm)
    found = codes(evidence(tag=tag, right_tag=in_right(tag, 3.0, 0.05)))
    assert not found & {"calibration_drift", "mispaired"}


def test_an_overexposed_tag_proves_no_drift() -> None:
    found = evidence(right_tag=in_right(make_tag(), 0.0, 0.05), clipped_share=0.5)
    assert codes(found) == {"overexposed"}


def test_rows_that_grow_with_nearness_mean_another_moment() -> None:
    shifted = in_right(make_tag(), 4.0)
    assert codes(evidence(right_tag=shifted, eyes=spots(-4.0))) == {"calibration_drift"}
    assert codes(evidence(right_tag=shifted, eyes=spots(slope=-0.017))) == {"mispaired"}


@pytest.mark.parametrize(
    ("eyes", "wanted"),
    [
        (spots(), set()),
        (spots(disparity_px=-234.0), {"swapped_eyes"}),
        (spots(rows_px=20.0), {"mispaired"}),
        (spots(rows_px=3.0), {"calibration_drift"}),
        (spots(rows_px=0.8), set()),
        (spots(found=3), {"mispaired"}),
        (EyeMatches(2, np.zeros((0, 2))), set()),
    ],
)
def test_spots_speak_where_one_eye_does_not_read_the_tag(
    eyes: EyeMatches, wanted: set[str]
) -> None:
    assert codes(evidence(right_tag=None, eyes=eyes)) == wanted
    assert codes(evidence(**UNREAD, eyes=eyes)) == wanted | {"no_tag"}


@pytest.mark.parametrize(
    ("x_px", "y_px"), [(250.0, 540.0), (1425.0, 540.0), (860.0, 20.0), (860.0, 1065.0)]
)
def test_a_cluster_at_the_border_of_either_eye_is_cut(x_px: float, y_px: float) -> None:
    """The right eye sees nothing of the left one's first 234 columns."""
    scale = CAMERA.focal_px / 440.0
    toward = (np.array([x_px, y_px]) - (CAMERA.cx_px, CAMERA.cy_px)) / scale
    beside = toward - 35 * toward / np.linalg.norm(toward)
    found = evidence(
        tag=make_tag(float(beside[0]), float(beside[1])),
        fruitlets=(make_fruitlet((x_px, y_px)),),
        expectation=Expectation(17),
    )
    assert codes(found) == {"cut_by_border"}


def test_a_neighbour_at_the_border_does_not_matter() -> None:
    others = (*evidence().fruitlets, make_fruitlet((1430, 540), in_target=False))
    assert codes(evidence(fruitlets=others)) == set()


@pytest.mark.parametrize(
    ("gap_mm", "found", "wanted"),
    [
        (15.0, True, {"cut_by_border"}),
        (30.0, True, set()),
        (30.0, False, {"cut_by_border"}),
        (60.0, False, {"no_fruitlets"}),
    ],
)
def test_a_tag_at_the_border_has_its_cluster_cut(
    gap_mm: float, found: bool, wanted: set[str]
) -> None:
    scale = CAMERA.focal_px / 440.0
    tag = make_tag((CAMERA.width_px - 1 - CAMERA.cx_px) / scale - gap_mm)
    inwards = make_fruitlet((tag.center_px[0] - 60.0, tag.center_px[1]))
    fruitlets = (inwards,) if found else ()
    assert codes(evidence(tag=tag, fruitlets=fruitlets, expectation=Expectation(17))) == wanted


def test_a_distant_fruitlet_without_depth_is_not_the_clusters() -> None:
    far_off = make_fruitlet((1300, 900), in_target=False)
    assert codes(evidence(fruitlets=(far_off,), depth_share=0.0)) == {"no_fruitlets"}


@pytest.mark.parametrize(("lost", "wanted"), [(1, set[str]()), (2, {"no_depth"})])
def test_fruitlets_beside_the_tag_without_depth_ask_for_a_retake(
    lost: int, wanted: set[str]
) -> None:
    measured = (make_fruitlet(), make_fruitlet((870, 580)))
    blind = (make_fruitlet((800 + 40 * i, 600), (Flag.NO_DEPTH,), False) for i in range(lost))
    found = evidence(fruitlets=(*measured, *blind), expectation=Expectation(17))
    assert codes(found) == wanted


def test_every_reason_says_what_to_do_in_one_short_sentence() -> None:
    texts = [r.text for _, changes, _, _ in CASES for r in judged(evidence(**changes)).reasons]
    assert texts
    for text in texts:
        assert len(text) < 80
        assert text.endswith((".", "?"))
