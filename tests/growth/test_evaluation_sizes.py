"""Sizes by camera against calipers: who is compared with whom, and what comes out."""

from __future__ import annotations

from datetime import timedelta

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_evaluation import caliper_block, caliper_fruit, day, named_cluster

from fieldcam.growth.evaluation.named import fruit_of, known_records
from fieldcam.growth.evaluation.sizing import (
    SizePair,
    compared,
    line_r2,
    only_by_calipers,
    only_by_camera,
    pair_sizes,
    score_sizes,
)
from fieldcam.growth.records import Presence

NAN = float("nan")


def pairs_of(sizes: list[tuple[float | None, float | None]]) -> list[SizePair]:
    return [
        SizePair(17, str(k), day(0), camera, calipers, camera is not None)
        for k, (camera, calipers) in enumerate(sizes)
    ]


def test_known_association_goes_by_name_and_keeps_the_larger_of_two_pictures() -> None:
    calipers = caliper_block(
        [
            caliper_fruit(17, "a", {0: 9.0, 4: 11.0}),
            caliper_fruit(17, "b", {0: 8.0, 4: None}),
            caliper_fruit(17, "c", {0: 7.0, 4: 8.0}),
        ]
    )
    cluster = named_cluster(17, {0: [[9.1, 8.1, None], [9.4, 8.0, NAN]], 4: [[11.2, NAN, NAN]]})
    found = known_records(cluster, fruit_of(calipers, 17))
    seen = {(f.fruitlet, on): s for f in found for on, s in f.sightings.items()}
    assert [seen["a", day(k)].diameter_mm for k in (0, 4)] == [9.4, 11.2]
    assert seen["b", day(4)].presence is Presence.FALLEN
    assert seen["c", day(0)].presence is Presence.SEEN
    assert seen["c", day(4)].presence is Presence.NOT_SEEN


def test_sizes_pair_by_name_even_where_their_order_is_turned_about() -> None:
    calipers = [caliper_fruit(17, "a", {0: 6.0}), caliper_fruit(17, "b", {0: 9.0})]
    camera = [caliper_fruit(17, "a", {0: 9.2}), caliper_fruit(17, "b", {0: 6.1})]
    pairs = pair_sizes(camera, calipers)
    assert [p.error_mm for p in pairs] == [pytest.approx(3.2), pytest.approx(-2.9)]


def test_whoever_is_missing_on_one_side_is_listed() -> None:
    calipers = [
        caliper_fruit(17, "a", {0: 6.0, 4: 7.0}),
        caliper_fruit(17, "gone", {0: 6.0, 4: None}),
        caliper_fruit(18, "a", {0: 8.0}),
    ]
    camera = [caliper_fruit(17, "a", {0: 6.3}), caliper_fruit(17, "new", {0: 5.0})]
    pairs = pair_sizes(camera, calipers)
    assert [(p.tag_id, p.fruit, p.day) for p in only_by_camera(pairs)] == [(17, "new", day(0))]
    assert [(p.tag_id, p.fruit, p.day) for p in only_by_calipers(pairs)] == [
        (17, "gone", day(0)),
        (18, "a", day(0)),
        (17, "a", day(4)),
    ]
    assert score_sizes(pairs).measured == 4 and score_sizes(pairs).sized == 1


def test_a_fruitlet_that_is_seen_without_a_size_is_matched_and_not_sized() -> None:
    cluster = named_cluster(17, {0: [[9.0, None]]})
    calipers = [caliper_fruit(17, "a", {0: 9.0}), caliper_fruit(17, "b", {0: 8.0})]
    pairs = pair_sizes(known_records(cluster, {}), calipers)
    assert not only_by_calipers(pairs)
    assert (score_sizes(pairs).measured, score_sizes(pairs).sized_pct) == (2, 50.0)


def test_a_column_of_the_table_by_hand() -> None:
    score = score_sizes(
        pairs_of([(10.5, 10.0), (7.6, 8.0), (13.0, 12.5), (None, 9.0), (6.0, None)])
    )
    assert (score.measured, score.sized, score.outliers) == (4, 3, 0)
    assert score.mae_mm == pytest.approx((0.5 + 0.4 + 0.5) / 3)
    assert score.mape_pct == pytest.approx(100 * (0.05 + 0.05 + 0.04) / 3)
    assert score.sized_pct == pytest.approx(75.0)
    assert score.agreement is not None
    assert score.agreement.bias_mm == pytest.approx(0.2)
    # Sums of products about the means: Sxy = 12.1167, Sxx = 10.1667, Syy = 14.6067.
    assert score.r2 == pytest.approx(12.11667**2 / (10.16667 * 14.60667), rel=1e-5)


@pytest.mark.parametrize(
    "sizes", [[], [(None, 9.0)], [(9.0, None)]], ids=["nothing", "not sized", "not measured"]
)
def test_nothing_to_compare_has_no_figures(sizes: list[tuple[float | None, float | None]]) -> None:
    score = score_sizes(pairs_of(sizes))
    assert (score.mae_mm, score.mape_pct, score.r2, score.agreement) == (None,) * 4


def test_outliers_are_of_their_day_and_leave_all_figures_but_the_sized_share() -> None:
    usual = {str(k): 8.0 + 0.1 * (k % 5) for k in range(40)}
    on = {day(0): usual | {"odd": 30.0}, day(4): {n: mm + 20 for n, mm in usual.items()}}
    camera = [
        caliper_fruit(17, n, {(d - day(0)).days: sizes[n]})
        for d, sizes in on.items()
        for n in sizes
    ]
    calipers = [
        caliper_fruit(17, n, {(d - day(0)).days: 8.2 if d == day(0) else 28.2})
        for d, sizes in on.items()
        for n in sizes
    ]
    pairs = pair_sizes(camera, calipers)
    assert [(p.fruit, p.day) for p in pairs if p.outlier] == [("odd", day(0))]
    score = score_sizes(pairs)
    assert (score.measured, score.sized, score.outliers) == (81, 81, 1)
    assert len(compared(pairs)[0]) == 80
    assert score.mae_mm is not None and score.mae_mm < 0.3


@given(
    st.lists(st.floats(4, 20), min_size=3, max_size=20, unique=True).filter(
        lambda sizes: np.ptp(sizes) > 0.1
    ),
    st.floats(0.2, 3),
    st.floats(-5, 5),
)
def test_a_line_is_blind_to_bias_and_scale(sizes: list[float], scale: float, bias: float) -> None:
    x = np.array(sizes)
    assert line_r2(x, scale * x + bias) == pytest.approx(1.0)
    assert score_sizes(pairs_of([(s + 1.0, s) for s in sizes])).mae_mm == pytest.approx(1.0)


@pytest.mark.parametrize("x", [[1.0, 2.0], [1.0, 1.0, 1.0]], ids=["two points", "one size"])
def test_no_line_through_too_little(x: list[float]) -> None:
    assert line_r2(np.array(x), np.arange(len(x), dtype=float)) is None


def test_two_walks_on_neighbouring_days_are_not_mixed() -> None:
    camera = [caliper_fruit(17, "a", {0: 9.0})]
    calipers = [caliper_fruit(17, "a", {1: 9.0})]
    assert [p.day - day(0) for p in pair_sizes(camera, calipers)] == [timedelta(0), timedelta(1)]
    assert score_sizes(pair_sizes(camera, calipers)).sized == 0
