"""Camera against calipers: bias, spread and limits of agreement."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcam.growth.agreement import ENOUGH, agreement

SIZES = st.lists(st.floats(3, 30), min_size=2, max_size=30)


def test_a_worked_example() -> None:
    found = agreement(5 * [10.2, 9.9, 12.5, 8.0], 5 * [10.0, 10.0, 12.0, 8.4])
    assert found is not None and found.n == 20
    # Differences 0.2, -0.1, 0.5, -0.4: mean 0.05, sum of squares 0.46 - 4 * 0.05^2 = 0.45, five
    # times over 19.
    assert found.bias_mm == pytest.approx(0.05)
    sd_mm = (5 * 0.45 / 19) ** 0.5
    assert found.sd_mm == pytest.approx(sd_mm)
    assert found.limits_mm == pytest.approx((0.05 - 1.96 * sd_mm, 0.05 + 1.96 * sd_mm))


def test_few_fruitlets_say_less() -> None:
    assert agreement([], []) is None
    single = agreement([9.5], [9.0])
    assert single is not None
    assert (single.n, single.bias_mm, single.sd_mm, single.limits_mm) == (1, 0.5, None, None)
    for count, known in ((2, False), (ENOUGH - 1, False), (ENOUGH, True)):
        several = agreement([9.5 + k / 10 for k in range(count)], [9.0] * count)
        assert several is not None and (several.limits_mm is not None) is known


@given(SIZES, st.floats(-2, 2))
def test_a_constant_error_is_all_bias(sizes: list[float], error_mm: float) -> None:
    found = agreement([size + error_mm for size in sizes], sizes)
    assert found is not None and found.sd_mm == pytest.approx(0, abs=1e-9)
    assert found.bias_mm == pytest.approx(error_mm, abs=1e-9)
