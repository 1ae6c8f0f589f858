"""Sizes are compared with the fruitlet that they really belong to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import pytest
from made_readings import disc_mask, made_fruitlet, made_reading

from fieldcam.report.scoring import score_capture, summary
from fieldcam.values import Fruitlet, Mask, Status, Verdict

if TYPE_CHECKING:
    from fieldcam.simulator import Truth


@dataclass(frozen=True)
class TrueOne:
    """What scoring looks at of a true fruitlet."""

    id: int
    in_target: bool
    diameter_mm: float
    visible: Mask
    visible_fraction: float = 1.0


@dataclass(frozen=True)
class TrueScene:
    fruitlets: tuple[TrueOne, ...]

    @property
    def target(self) -> tuple[TrueOne, ...]:
        return tuple(f for f in self.fruitlets if f.in_target)


def scene(*fruitlets: TrueOne) -> Truth:
    return cast("Truth", TrueScene(fruitlets))


def true_one(number: int, x: float, diameter_mm: float = 9.0, in_target: bool = True) -> TrueOne:
    return TrueOne(number, in_target, diameter_mm, disc_mask(x, 100.0, 18))


def seen(number: int, x: float, diameter_mm: float | None = 9.0) -> Fruitlet:
    return made_fruitlet(number, (x, 100.0), diameter_mm)


def test_readings_meet_the_fruitlet_that_they_overlap() -> None:
    truth = scene(true_one(4, 100.0, 8.0), true_one(2, 112.0, 10.0))
    scored = score_capture(made_reading([seen(0, 113.0, 10.3), seen(1, 101.0, 7.9)]), truth)
    assert [s.truth.id for s in scored.fruitlets if s.truth] == [2, 4]
    assert [s.error_mm for s in scored.fruitlets] == [pytest.approx(0.3), pytest.approx(-0.1)]


def test_foreign_readings_are_counted_and_never_scored() -> None:
    truth = scene(true_one(0, 100.0), true_one(-1, 300.0, in_target=False))
    reading = made_reading([seen(0, 100.0), seen(1, 300.0), seen(2, 500.0)])
    scored = score_capture(reading, truth)
    assert scored.foreign == 2
    figures = summary([scored])
    assert figures["sizes"] == 1
    assert figures["foreign_share"] == pytest.approx(2 / 3, abs=1e-4)


def test_two_readings_of_one_fruitlet_leave_one_foreign() -> None:
    scored = score_capture(
        made_reading([seen(0, 100.0), seen(1, 101.0)]), scene(true_one(0, 100.0))
    )
    assert scored.foreign == 1


def test_the_summary_counts_what_was_not_sized() -> None:
    hidden = TrueOne(1, True, 9.0, disc_mask(200.0, 100.0, 18), visible_fraction=0.3)
    truth = scene(true_one(0, 100.0), hidden, true_one(2, 300.0), true_one(3, 400.0))
    reading = made_reading([seen(0, 100.0, 9.2), seen(1, 200.0, None), seen(2, 300.0, 8.9)])
    figures = summary([score_capture(reading, truth)])
    assert figures["mae_mm"] == pytest.approx(0.15)
    assert figures["bias_mm"] == pytest.approx(0.05)
    assert figures["sized_share_well_visible"] == pytest.approx(2 / 3, abs=1e-4)
    assert figures["sized_share_all"] == pytest.approx(0.5)


def test_an_empty_walk_has_no_figures() -> None:
    figures = summary([])
    assert figures["mae_mm"] is None and figures["foreign_share"] is None
    retake = score_capture(made_reading(verdict=Verdict(Status.RETAKE)), scene())
    assert summary([retake])["retakes"] == 1


@pytest.mark.parametrize(("x", "expected"), [(100.0, 1.0), (109.0, 0.24), (130.0, 0.0)])
def test_overlap_of_two_discs(x: float, expected: float) -> None:
    one, two = disc_mask(100.0, 100.0, 18), disc_mask(x, 100.0, 18)
    assert one.iou(two) == pytest.approx(expected, abs=0.03)
    assert two.iou(one) == one.iou(two)
