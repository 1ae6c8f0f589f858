"""The fruitlet growth model: who persists, who counts, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from time import process_time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_records import FALLEN, NOT_SEEN, SEEN, Known, fast_ones, made_block, made_fruitlet, on
from planned_blocks import Measuring, day_date, measured_block, true_set_pct

from fieldcam.errors import BadInput
from fieldcam.growth.crop import CropPlan, CropVerdict, crop_forecast
from fieldcam.growth.forecast import Forecast, FruitletState, counts_of, forecast, trend
from fieldcam.growth.influence import influences
from fieldcam.growth.records import BlockRecord, FruitletRecord, SizeSource
from fieldcam.growth.size_order import in_size_order
from fieldcam.growth.visits import BlockVisit, chosen_interval, visits_of
from fieldcam.growth.warnings.block import warnings_about
from fieldcam.growth.warnings.doubts import Doubt, doubts_told
from fieldcam.simulator.plan import BlockPlan


def state_of(found: Forecast, name: str) -> FruitletState:
    return next(each.state for each in found.fruitlets if each.fruitlet.fruitlet == name)


ONE: dict[str, tuple[dict[int, Known], FruitletState]] = {
    "faster than half the reference": ({0: 8.0, 4: 10.1}, FruitletState.PERSIST),
    "a tie": ({0: 8.1, 4: 10.1}, FruitletState.ABSCISE),
    "shrunk": ({0: 8.0, 4: 7.0}, FruitletState.ABSCISE),
    "shrunk by a slip of the pen": ({0: 80.0, 4: 9.0}, FruitletState.ABSCISE),
    "as fast as fruit grows": ({0: 8.0, 4: 18.0}, FruitletState.PERSIST),
    "faster than fruit grows": ({0: 8.0, 4: 18.1}, FruitletState.IGNORED),
    "faster, then fallen": ({0: 8.0, 2: 18.1, 4: FALLEN}, FruitletState.FALLEN),
    "fallen": ({0: 8.0, 4: FALLEN}, FruitletState.FALLEN),
    "fallen, then hidden": ({0: 8.0, 2: FALLEN, 4: NOT_SEEN}, FruitletState.FALLEN),
    "taken for fallen, but seen again": ({0: 8.0, 2: FALLEN, 4: 12.0}, FruitletState.PERSIST),
    "hidden": ({0: 8.0, 4: NOT_SEEN}, FruitletState.NOT_SEEN),
    "seen without a size": ({0: 8.0, 4: SEEN}, FruitletState.NOT_SEEN),
    "nothing known": ({0: 8.0}, FruitletState.NOT_SEEN),
    "first seen later": ({4: 9.0}, FruitletState.NEW),
    "no first size": ({0: SEEN, 4: 12.0}, FruitletState.IGNORED),
    "no first size and fallen": ({0: SEEN, 4: FALLEN}, FruitletState.IGNORED),
}


@pytest.mark.parametrize(("known", "state"), ONE.values(), ids=ONE)
def test_each_fruitlet_has_one_state(known: dict[int, Known], state: FruitletState) -> None:
    block = made_block([*fast_ones(), made_fruitlet(2, "it", known)])
    found = forecast(block, on(0), on(4))
    assert state_of(found, "it") is state
    fastest = 1.075 if known == {0: 8.0, 4: 18.0} else 1.0
    assert found.reference.rate_mm_per_day == pytest.approx(fastest)


def steady(*days: int) -> list[FruitletRecord]:
    """20 fruitlets of cluster 1 that grow 1 mm/day, of many sizes, so that none is an outlier."""
    return [made_fruitlet(1, str(i), {day: 6.0 + i / 4 + day for day in days}) for i in range(20)]


BY_CAMERA: dict[str, tuple[dict[int, Known], FruitletState, float | None]] = {
    "first seen later": ({2: 8.0, 4: 9.2}, FruitletState.PERSIST, 0.6),
    "first seen later and slow": ({2: 8.0, 4: 8.8}, FruitletState.ABSCISE, 0.4),
    "first sized later": ({0: SEEN, 2: 8.0, 4: 9.2}, FruitletState.PERSIST, 0.6),
    "the widest interval": ({0: 8.0, 2: 8.0, 4: 10.1}, FruitletState.PERSIST, 0.525),
    "first seen at the end": ({4: 9.0}, FruitletState.NOT_SEEN, None),
    "first sized at the end": ({0: SEEN, 2: SEEN, 4: 9.0}, FruitletState.NOT_SEEN, None),
    "first seen later, then hidden": ({2: 8.0, 4: NOT_SEEN}, FruitletState.NOT_SEEN, None),
    "first seen later, then fallen": ({2: 8.0, 4: FALLEN}, FruitletState.FALLEN, None),
    "seen without a size, then fallen": ({0: SEEN, 4: FALLEN}, FruitletState.FALLEN, None),
    "first seen later, faster than fruit grows": ({2: 8.0, 4: 13.1}, FruitletState.IGNORED, None),
}


@pytest.mark.parametrize(("known", "state", "rate"), BY_CAMERA.values(), ids=BY_CAMERA)
def test_what_a_camera_sees_later_hung_there_at_first(
    known: dict[int, Known], state: FruitletState, rate: float | None
) -> None:
    """In a cluster that was photographed on the first visit."""
    others = [*steady(0, 2, 4), made_fruitlet(2, "other", {0: 8.0, 2: 10.0, 4: 12.0})]
    block = made_block([*others, made_fruitlet(2, "it", known)], SizeSource.CAMERA)
    found = forecast(block, on(0), on(4))
    it = found.fruitlets[-1]
    assert (it.state, it.rate_mm_per_day) == (state, rate)
    counted = state is not FruitletState.IGNORED
    assert (found.counts.initial, found.ignored) == (21 + counted, 1 - counted)
    persist = 21 + (state is FruitletState.PERSIST)
    judged = 21 + (state in (FruitletState.PERSIST, FruitletState.ABSCISE, FruitletState.FALLEN))
    assert found.set_pct == pytest.approx(100 * persist / judged)


def test_what_only_the_end_shows_changes_no_percent_and_no_end_but_the_intervals() -> None:
    """A late one stands for others that had fallen before anybody saw them."""
    fast = [made_fruitlet(1, str(i), {0: 8.0, 4: 12.0}) for i in range(20)]
    fell = [made_fruitlet(1, f"fell {i}", {0: 8.0, 4: FALLEN}) for i in range(20)]
    late = [made_fruitlet(1, f"late {i}", {4: 9.0}) for i in range(10)]
    few, more = (
        forecast(made_block(fruitlets, SizeSource.CAMERA), on(0), on(4))
        for fruitlets in ([*fast, *fell], [*fast, *fell, *late])
    )
    assert more.counts.not_seen == 10 and more.counts.initial == few.counts.initial + 10
    assert more.set_pct == few.set_pct == 50.0
    (low, high), of_few = more.interval90_pct, few.interval90_pct
    assert high - low > of_few[1] - of_few[0]


@pytest.mark.parametrize("source", SizeSource)
def test_a_cluster_that_was_tagged_later_is_not_counted(source: SizeSource) -> None:
    block = made_block([*steady(0, 2, 4), made_fruitlet(2, "it", {2: 8.0, 4: 9.0})], source)
    found = forecast(block, on(0), on(4))
    assert (state_of(found, "it"), found.counts.initial) == (FruitletState.NEW, 20)
    assert "clusters_added" in {each.code for each in warnings_about(found)}


def test_a_cluster_without_a_picture_on_the_first_of_the_two_visits_leaves_as_a_whole() -> None:
    """Though a visit between the two shows it."""
    known: dict[int, Known] = {0: 8.0, 6: 12.0, 8: 14.0}
    block = made_block([*steady(0, 4, 6, 8), made_fruitlet(2, "it", known)], SizeSource.CAMERA)
    assert state_of(forecast(block, on(4), on(8)), "it") is FruitletState.NOT_SEEN
    assert state_of(forecast(block, on(0), on(8)), "it") is FruitletState.PERSIST


def test_counts_and_percent() -> None:
    others = [
        made_fruitlet(2, "slow", {0: 8.0, 4: 8.5}),
        made_fruitlet(2, "fell", {0: 8.0, 4: FALLEN}),
        made_fruitlet(2, "hid", {0: 8.0, 4: NOT_SEEN}),
        made_fruitlet(3, "late", {4: 12.0}),
        made_fruitlet(3, "unsized", {0: SEEN, 4: 12.0}),
    ]
    found = forecast(made_block([*fast_ones(), *others]), on(0), on(4))
    counts = found.counts
    assert (counts.initial, counts.persist, counts.abscise) == (23, 20, 2)
    assert (counts.fallen, counts.not_seen) == (1, 1)
    assert found.set_pct == pytest.approx(100 * 20 / 22)


def test_every_fruitlet_grows_over_its_own_days() -> None:
    """Clusters 1 on days 0 and 4, cluster 2 on the days after the first and before the last."""
    fruitlets = [
        *(made_fruitlet(1, f"a{i}", {0: 8.0, 5: 13.0}) for i in range(20)),
        made_fruitlet(2, "same rate", {1: 8.0, 6: 13.0}),
        made_fruitlet(3, "shorter", {1: 8.0, 5: 10.2}),
    ]
    block = made_block(fruitlets)
    assert [visit.days for visit in visits_of(block)] == [(on(0), on(1)), (on(5), on(6))]
    found = forecast(block, on(0), on(6))
    rates = {each.fruitlet.fruitlet: each.rate_mm_per_day for each in found.fruitlets}
    assert rates["same rate"] == pytest.approx(1.0)
    assert rates["shorter"] == pytest.approx(0.55)
    assert state_of(found, "shorter") is FruitletState.PERSIST


def test_a_block_walked_daily_has_a_visit_each_day() -> None:
    block = made_block([made_fruitlet(1, "a", {0: 8.0, 1: 8.5, 2: 9.0, 3: 9.5})])
    assert len(visits_of(block)) == 4
    assert chosen_interval(block) == (on(0), on(3))


@pytest.mark.parametrize(
    ("days", "chosen"),
    [((0, 4), (0, 4)), ((0, 2, 4), (0, 4)), ((0, 3, 6, 8), (3, 8)), ((0, 2), (0, 2))],
)
def test_the_newest_visit_against_the_latest_three_days_before(
    days: tuple[int, ...], chosen: tuple[int, int]
) -> None:
    block = made_block([made_fruitlet(1, "a", {day: 8.0 + day for day in days})])
    assert chosen_interval(block) == (on(chosen[0]), on(chosen[1]))


@pytest.mark.parametrize("count", [1, 5, 19])
def test_fewer_than_twenty_are_all_the_reference(count: int) -> None:
    found = forecast(made_block(fast_ones(count)), on(0), on(4))
    assert found.reference.n == count
    assert found.reference.rate_mm_per_day == pytest.approx(1.0)
    assert found.set_pct == 100.0


def test_where_all_shrink_none_persists() -> None:
    found = forecast(made_block(fast_ones(25, rate=-0.2)), on(0), on(4))
    assert found.reference.cutoff_mm_per_day == 0.0
    assert found.set_pct == 0.0


def test_initial_ones_are_those_of_the_first_visit() -> None:
    fruitlets = [
        *(made_fruitlet(1, f"a{i}", {0: 6.0, 4: 9.0, 8: 13.0}) for i in range(20)),
        *(made_fruitlet(2, f"b{i}", {0: 6.0, 4: FALLEN, 8: FALLEN}) for i in range(20)),
    ]
    found = forecast(made_block(fruitlets), on(4), on(8))
    assert (found.counts.initial, found.counts.fallen, found.set_pct) == (40, 20, 50.0)


@pytest.mark.parametrize(
    ("source", "ignored", "together"),
    [(SizeSource.CAMERA, [1, 0, 1], 24), (SizeSource.CALIPERS, [2, 1, 0], 23)],
)
def test_initial_and_ignored_ones_are_as_many_for_all_visits(
    source: SizeSource, ignored: list[int], together: int
) -> None:
    fruitlets = [
        *(made_fruitlet(1, f"a{i}", {0: 6.0 + i / 9, 4: 9.0, 8: 13.0}) for i in range(20)),
        made_fruitlet(2, "late size", {0: SEEN, 4: 9.0, 8: 12.0}),
        made_fruitlet(2, "wrong", {0: 8.0, 4: 40.0, 8: 11.0}),
        made_fruitlet(2, "gap", {0: 8.0, 4: NOT_SEEN, 8: 11.0}),
        made_fruitlet(2, "new", {4: 8.0, 8: 11.0}),
    ]
    block = made_block(fruitlets, source)
    found = [forecast(block, on(a), on(b)) for a, b in ((0, 4), (0, 8), (4, 8))]
    assert [each.ignored for each in found] == ignored
    assert {each.counts.initial + each.ignored for each in found} == {together}


@pytest.mark.parametrize(
    ("missed", "left", "fallen"),
    [
        ({0: 8.0, 4: 10.0}, {0: 8.0, 4: FALLEN}, 0),
        ({0: 8.0, 8: 12.0}, {0: 8.0, 8: FALLEN}, 0),
        ({0: 8.0, 8: FALLEN}, {0: 8.0, 8: FALLEN}, 0),
        ({0: 8.0, 4: FALLEN}, {0: 8.0, 4: FALLEN}, 2),
        ({0: 8.0, 4: 10.0, 8: NOT_SEEN}, {0: 8.0, 4: FALLEN}, 1),
    ],
    ids=["at the end", "at the start", "and fell", "all fell before", "visited but hidden"],
)
def test_a_cluster_that_was_missed_leaves_as_a_whole(
    missed: dict[int, Known], left: dict[int, Known], fallen: int
) -> None:
    fast = [made_fruitlet(1, str(i), {0: 8.0, 4: 12.0, 8: 16.0}) for i in range(20)]
    cluster = [made_fruitlet(2, "a", missed), made_fruitlet(2, "b", left)]
    found = forecast(made_block([*fast, *cluster]), on(4), on(8))
    assert (found.counts.fallen, found.counts.not_seen) == (fallen, 2 - fallen)
    assert found.set_pct == pytest.approx(100 * 20 / (20 + fallen))


def test_a_slip_of_the_pen_changes_nothing_for_the_others() -> None:
    others = [
        made_fruitlet(tag, name, {0: 8.0, 4: 8.5 + tag / 9})
        for tag in range(2, 12)
        for name in "abc"
    ]
    right = forecast(made_block(others), on(0), on(4))
    slip = made_fruitlet(2, "d", {0: 8.0, 4: 95.0})
    for block in (made_block([*others, slip]), in_size_order(made_block([*others, slip]))):
        found = forecast(block, on(0), on(4))
        assert (found.reference.rate_mm_per_day, found.ignored, found.set_pct) == (
            right.reference.rate_mm_per_day,
            1,
            right.set_pct,
        )


@pytest.mark.parametrize(
    ("first", "last", "written"),
    [
        (date(2026, 5, 14), date(2026, 5, 14), "2026-05-14"),
        (date(2026, 5, 14), date(2026, 5, 15), "2026-05-14/15"),
        (date(2026, 5, 31), date(2026, 6, 1), "2026-05-31/06-01"),
        (date(2026, 12, 31), date(2027, 1, 1), "2026-12-31/2027-01-01"),
    ],
)
def test_a_visit_is_called_by_all_its_days(first: date, last: date, written: str) -> None:
    days = tuple(dict.fromkeys((first, last)))
    assert str(BlockVisit(days, frozenset())) == written


@pytest.mark.parametrize("source", SizeSource)
def test_sizes_far_from_all_others_are_ignored_where_a_camera_took_them(source: SizeSource) -> None:
    block = made_block([*fast_ones(40), made_fruitlet(2, "it", {0: 8.0, 4: 17.9})], source)
    state = state_of(forecast(block, on(0), on(4)), "it")
    assert state is (
        FruitletState.IGNORED if source is SizeSource.CAMERA else FruitletState.PERSIST
    )


REFUSED: dict[str, tuple[list[FruitletRecord], str]] = {
    "no visit": ([], "Block Gala has no visit; growth needs two."),
    "one visit": ([made_fruitlet(1, "a", {0: 8.0})], "Block Gala has only the visit of 2026-05-10"),
    "all fallen": (
        [made_fruitlet(1, name, {0: 8.0, 4: FALLEN}) for name in "ab"],
        "No fruitlet of block Gala has a size both on 2026-05-10 and on 2026-05-14: all 2 have",
    ),
    "all too fast": (
        [made_fruitlet(1, name, {0: 8.0, 1: 10.6}) for name in "ab"],
        "All fruitlets of block Gala that have a size both on 2026-05-10 and on 2026-05-11 grew",
    ),
    "none seen again": (
        [made_fruitlet(1, "a", {0: 8.0, 4: NOT_SEEN})],
        "No fruitlet of block Gala has a size both",
    ),
}


@pytest.mark.parametrize(("fruitlets", "message"), REFUSED.values(), ids=REFUSED)
def test_what_gives_no_forecast_is_said(fruitlets: list[FruitletRecord], message: str) -> None:
    block = made_block(fruitlets)
    with pytest.raises(BadInput) as refused:
        forecast(block, *chosen_interval(block))
    assert refused.value.message.startswith(message)


@pytest.mark.parametrize(
    ("start", "end", "message"),
    [
        (on(4), on(0), "The visit of 2026-05-10 is not after that of 2026-05-14."),
        (on(0), on(0), "The visit of 2026-05-10 is not after"),
        (on(0), on(9), "Block Gala was not measured on 2026-05-19."),
        (None, on(0), "Block Gala has no visit before that of 2026-05-10."),
    ],
)
def test_visits_that_do_not_fit_are_refused(start: date | None, end: date, message: str) -> None:
    block = made_block(fast_ones())
    with pytest.raises(BadInput) as refused:
        forecast(block, *chosen_interval(block, start, end))
    assert refused.value.message.startswith(message)


SIZES = st.integers(30, 200).map(lambda tenths: tenths / 10)


@settings(max_examples=25)
@given(st.lists(st.tuples(SIZES, st.none() | SIZES), min_size=21, max_size=60))
def test_agrees_with_the_rule_of_the_spreadsheets(pairs: list[tuple[float, float | None]]) -> None:
    """Written down anew, in tenths of a millimetre: exact, but for ties that persist there."""
    if not any(after is not None for _, after in pairs):
        return
    grown = [None if after is None else round(10 * after) - round(10 * b) for b, after in pairs]
    fastest = sorted(g for g in grown if g is not None)[-20:]
    persist = sum(g is not None and g * 2 * len(fastest) > max(sum(fastest), 0) for g in grown)
    block = made_block(
        [
            made_fruitlet(i % 9, str(i), {0: before, 8: FALLEN if after is None else after})
            for i, (before, after) in enumerate(pairs)
        ]
    )
    found = forecast(block, on(0), on(8))
    assert found.counts.persist == persist
    assert found.set_pct == pytest.approx(100 * persist / len(pairs))


@pytest.fixture(scope="module")
def planned() -> BlockRecord:
    return measured_block(BlockPlan.plan(41, 70), Measuring(SizeSource.CAMERA, (0, 2, 4, 8)), 41)


def test_the_trend_has_a_forecast_for_each_visit_after_the_first(planned: BlockRecord) -> None:
    steps = [(each.start.first, each.end.first) for each in trend(planned)]
    days = [(0, 2), (0, 4), (4, 8)]
    assert steps == [(day_date(a), day_date(b)) for a, b in days]


def test_without_errors_the_forecast_is_the_truth() -> None:
    block = BlockPlan.plan(42, 70)
    record = measured_block(block, Measuring(SizeSource.CALIPERS, (0, 4), noisy=False), 42)
    found = forecast(record, day_date(0), day_date(4))
    assert found.set_pct == pytest.approx(true_set_pct(block, 0, 4))


def test_the_influence_of_a_cluster_is_what_changes_without_it(planned: BlockRecord) -> None:
    calipers = measured_block(BlockPlan.plan(43, 30), Measuring(SizeSource.CALIPERS, (0, 4)), 43)
    found = forecast(calipers, day_date(0), day_date(4))
    first = influences(found)[0]
    others = [each for each in calipers.fruitlets if each.tag_id != first.tag_id]
    without = forecast(made_block(others), day_date(0), day_date(4))
    assert first.influence_points == pytest.approx(found.set_pct - without.set_pct)
    assert len(influences(found)) == 30


def test_the_influence_of_thousands_of_clusters_takes_no_minute(planned: BlockRecord) -> None:
    found = forecast(planned, day_date(0), day_date(4))
    more = [
        replace(each, fruitlet=replace(each.fruitlet, tag_id=each.fruitlet.tag_id + 1000 * copy))
        for copy in range(20_000 // len(found.fruitlets))
        for each in found.fruitlets
    ]
    many = replace(found, fruitlets=tuple(more), counts=counts_of(more))
    began = process_time()
    assert len(influences(many)) > 2000
    assert process_time() - began < 5


def unsure(fruitlet: FruitletRecord, day: int, confidence: float) -> FruitletRecord:
    doubted = replace(fruitlet.sightings[on(day)], confidence=confidence)
    return replace(fruitlet, sightings={**fruitlet.sightings, on(day): doubted})


@pytest.mark.parametrize("source", list(SizeSource))
def test_a_doubtful_match_is_marked_and_no_part_of_the_reference(source: SizeSource) -> None:
    fast = made_fruitlet(2, "fast", {0: 6.0, 4: 14.0})
    slow = [made_fruitlet(1, f"slow {mm}", {0: 4.0 + mm, 4: 4.5 + mm}) for mm in range(12)]
    others = [*fast_ones(30), *slow]
    sure = forecast(made_block([*others, fast], source), on(0), on(4))
    found = forecast(made_block([*others, unsure(fast, 4, 0.53)], source), on(0), on(4))
    assert found.reference.measured_mm_per_day == pytest.approx(1.0)
    assert found.reference.measured_mm_per_day < sure.reference.measured_mm_per_day
    assert found.reference.corrected_mm_per_day < sure.reference.corrected_mm_per_day
    doubts = {each.fruitlet.fruitlet: each.doubts for each in found.fruitlets}
    assert doubts["fast"] == (Doubt.MATCH,)
    assert set(doubts.values()) == {(), (Doubt.MATCH,)}
    (warning,) = (each for each in warnings_about(found) if each.code == "doubtful_matches")
    assert warning.text.startswith(
        "The match of 1 fruitlet is less than 90 % sure: fruitlet fast of cluster 2."
    )
    of_two = next(each for each in influences(found) if each.tag_id == 2)
    without = forecast(made_block(others, source), on(0), on(4))
    assert of_two.influence_points == pytest.approx(found.set_pct - without.set_pct)


def test_where_all_matches_are_doubtful_they_are_the_reference() -> None:
    found = forecast(
        made_block([unsure(each, 4, 0.5) for each in fast_ones()], SizeSource.CAMERA), on(0), on(4)
    )
    assert found.reference.measured_mm_per_day == pytest.approx(1.0)


def test_growth_that_no_fruitlet_has_is_marked() -> None:
    leaf = made_fruitlet(2, "leaf", {0: 12.8, 1: 16.8})
    found = forecast(made_block([*fast_ones(days=1), leaf]), on(0), on(1))
    marked = next(each for each in found.fruitlets if each.fruitlet == leaf)
    assert (marked.state, marked.doubts) == (FruitletState.IGNORED, (Doubt.GROWTH,))
    assert list(doubts_told(leaf, [on(0), on(1)])) == [
        "4.0 mm/day to 2026-05-11, which no fruitlet grows"
    ]


def known_to(fruitlet: FruitletRecord, sds_mm: dict[int, float]) -> FruitletRecord:
    """With the standard deviations of its sizes, by day."""
    sightings = {
        day: replace(seen, sd_mm=sds_mm.get((day - on(0)).days))
        for day, seen in fruitlet.sightings.items()
    }
    return replace(fruitlet, sightings=sightings)


@pytest.mark.parametrize(
    ("source", "sds_mm", "grown_mm", "shrunk"),
    [
        (SizeSource.CAMERA, {0: 0.3, 4: 0.4}, -1.45, False),
        (SizeSource.CAMERA, {0: 0.3, 4: 0.4}, -1.55, True),
        (SizeSource.CAMERA, {0: 0.06, 4: 0.08}, -0.25, False),
        (SizeSource.CAMERA, {0: 0.06, 4: 0.08}, -0.35, True),
        (SizeSource.CAMERA, {0: 0.06}, -0.35, False),
        (SizeSource.CAMERA, {}, -1.1, False),
        (SizeSource.CAMERA, {}, -1.2, True),
        (SizeSource.CALIPERS, {}, -0.5, False),
        (SizeSource.CALIPERS, {}, -0.9, True),
    ],
)
def test_no_fruitlet_shrinks_by_more_than_its_errors(
    source: SizeSource, sds_mm: dict[int, float], grown_mm: float, shrunk: bool
) -> None:
    """It counts as falling, and what speaks against its sizes is told everywhere."""
    it = known_to(made_fruitlet(2, "it", {0: 9.5, 4: 9.5 + grown_mm}), sds_mm)
    found = forecast(made_block([*steady(0, 4), it], source), on(0), on(4))
    marked = found.fruitlets[-1]
    assert (marked.state, marked.doubts) == (FruitletState.ABSCISE, (Doubt.SHRUNK,) * shrunk)
    said = [f"{-grown_mm:.1f} mm less on 2026-05-14, which no fruitlet shrinks"] * shrunk
    assert list(doubts_told(it, [on(0), on(4)], source)) == said
    texts = {each.code: each.text for each in warnings_about(found)}
    assert ("1 fruitlet shrank by more than" in texts.get("odd_growth", "")) is shrunk


def test_what_shrank_stays_in_a_reference_of_few() -> None:
    few = [made_fruitlet(1, "a", {0: 8.0, 4: 12.0}), made_fruitlet(1, "b", {0: 12.0, 4: 8.0})]
    found = forecast(made_block(few, SizeSource.CAMERA), on(0), on(4))
    assert found.reference.rate_mm_per_day == 0.0


def test_fruit_per_tree_counts_clusters_that_lost_everything() -> None:
    lost = [made_fruitlet(2, name, {0: 8.0, 4: FALLEN}) for name in "abcde"]
    found = forecast(made_block([*fast_ones(), *lost]), on(0), on(4))
    crop = crop_forecast(found, CropPlan(bloom_clusters=50))
    assert crop.fruit == pytest.approx(50 * 20 / 2)
    assert crop.fruit_by_potential == pytest.approx(0.8 * 50 * 5)
    assert crop.verdict is None


@pytest.mark.parametrize(
    ("target", "verdict"),
    [(1.0, CropVerdict.TOO_MANY), (None, None), (10_000.0, CropVerdict.TOO_FEW)],
)
def test_the_verdict_is_that_of_the_interval(
    planned: BlockRecord, target: float | None, verdict: CropVerdict | None
) -> None:
    found = forecast(planned, day_date(4), day_date(8))
    crop = crop_forecast(found, CropPlan(200.0, target))
    assert crop.interval90_fruit is not None
    low, high = crop.interval90_fruit
    assert crop.verdict is verdict
    assert low < crop.fruit < high
    for inside in np.linspace(low, high, 3):
        reached = crop_forecast(found, CropPlan(200.0, float(inside)))
        assert reached.verdict is CropVerdict.ON_TARGET
