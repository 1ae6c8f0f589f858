"""The printed tag's size, read off stored readings as the verdicts take it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_evidence import codes, evidence, in_right, make_tag
from made_readings import made_reading

from fieldcam.calibration.drift import TAG_SIZE_BIAS
from fieldcam.calibration.stored_drift import TagSizes, tag_sizes
from fieldcam.codec.readings import dump_reading, load_reading
from fieldcam.values import TAG_SIZE_MM, ClusterReading, Settings


def reading(error: float | None, printed_mm: float = TAG_SIZE_MM) -> ClusterReading:
    return replace(made_reading(), tag_size_error=error, settings=Settings(tag_size_mm=printed_mm))


@pytest.mark.parametrize(
    "wider", [-0.06, -0.041, -0.03, -0.02, -0.0055, 0.0, 0.01, 0.014, 0.016, 0.03, 0.06, 0.2]
)
def test_device_and_verdict_agree(wider: float) -> None:
    found = evidence(right_tag=in_right(make_tag(), wider=wider))
    assert found.tag_size_error == pytest.approx(wider, abs=1e-6)
    drifted = tag_sizes([reading(found.tag_size_error)] * 3).drifted
    assert drifted == bool(codes(found) & {"calibration_drift", "mispaired"})


def test_a_reading_keeps_what_its_tag_measured() -> None:
    for error in (None, -0.0123):
        assert load_reading(dump_reading(reading(error))).tag_size_error == error


def test_readings_that_do_not_tell_are_left_out() -> None:
    assert tag_sizes([reading(None), reading(None)]) == TagSizes(())
    assert TagSizes(()).measured_mm is None and TagSizes(()).drift is None


def test_cards_of_another_size_are_not_mixed_with_these() -> None:
    found = tag_sizes([reading(0.01, 30.0), reading(0.07), reading(0.03, 30.0)])
    assert found == TagSizes((0.01, 0.03), 30.0)
    assert found.measured_mm == pytest.approx(30.6)


def test_drift_is_told_from_the_median_of_enough_pictures() -> None:
    assert TagSizes((0.05, 0.05)).drift is None and not TagSizes((0.05, 0.05)).drifted
    assert not TagSizes((TAG_SIZE_BIAS, TAG_SIZE_BIAS, 0.05)).drifted
    assert TagSizes((0.05, 0.04, TAG_SIZE_BIAS)).drifted
    assert TagSizes((0.0, 0.1, 0.0)).measured_mm == TAG_SIZE_MM
