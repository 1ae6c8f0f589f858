"""What a grower is told to doubt."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_records import FALLEN, NOT_SEEN, fast_ones, made_block, made_fruitlet, on

from fieldcam.errors import BadInput
from fieldcam.growth.forecast import forecast
from fieldcam.growth.records import BlockRecord, FruitletRecord, SizeSource
from fieldcam.growth.sprays import SprayDay
from fieldcam.growth.visits import chosen_interval
from fieldcam.growth.warnings.block import warnings_about


def many_clusters(first_mm: float = 8.0, rate: float = 0.8, days: int = 4) -> list[FruitletRecord]:
    """50 clusters of two fruitlets, visited three times."""
    return [
        made_fruitlet(
            tag,
            name,
            {
                0: first_mm,
                days: first_mm + rate * days,
                2 * days: first_mm + 2 * rate * days,
            },
        )
        for tag in range(1, 51)
        for name in "ab"
    ]


def codes(block: BlockRecord, start: int, end: int) -> set[str]:
    return {warning.code for warning in warnings_about(forecast(block, on(start), on(end)))}


def test_nothing_is_said_about_a_good_block() -> None:
    assert codes(made_block(many_clusters()), 4, 8) == set()


@pytest.mark.parametrize(
    ("block", "start", "end", "code"),
    [
        (made_block(many_clusters()), 0, 4, "first_interval"),
        (made_block(many_clusters(days=2)), 2, 4, "short_interval"),
        (made_block(many_clusters(first_mm=2.0)), 4, 8, "small_fruitlets"),
        (made_block(many_clusters()[:98]), 4, 8, "few_clusters"),
        (made_block(many_clusters()[:19]), 4, 8, "few_fruitlets"),
        (
            made_block([*many_clusters(), made_fruitlet(60, "a", {4: 8.0, 8: 11.0})]),
            4,
            8,
            "clusters_added",
        ),
        (made_block(many_clusters(rate=0.2)), 4, 8, "odd_reference"),
        (made_block(many_clusters(rate=1.6)), 4, 8, "odd_reference"),
    ],
)
def test_each_doubt_has_its_code(block: BlockRecord, start: int, end: int, code: str) -> None:
    assert code in codes(block, start, end)


@pytest.mark.parametrize(("hidden", "said"), [(11, False), (12, True)])
def test_more_than_a_tenth_not_seen(hidden: int, said: bool) -> None:
    lost = [made_fruitlet(60, str(i), {0: 8.0, 4: 11.0, 8: NOT_SEEN}) for i in range(hidden)]
    block = made_block([*many_clusters(), *lost])
    assert ("many_not_seen" in codes(block, 4, 8)) is said


@pytest.mark.parametrize(
    ("end_mm", "said"),
    [(9.9, "counted as falling"), (10.5, ""), (20.9, ""), (21.1, "left out"), (95.0, "left out")],
)
def test_growth_that_no_fruitlet_has(end_mm: float, said: str) -> None:
    told = told_of([*many_clusters(), made_fruitlet(1, "odd", {0: 8.0, 4: 11.0, 8: end_mm})])
    assert said in told.get("odd_growth", "") and ("odd_growth" in told) is bool(said)
    assert not said or told["odd_growth"].endswith("fruitlet odd of cluster 1.")


def test_each_growth_that_no_fruitlet_has_is_named_with_its_own() -> None:
    odd = [made_fruitlet(1, str(mm), {0: 8.0, 4: 11.0, 8: mm}) for mm in (6.0, 95.0)]
    first, second = told_of([*many_clusters(), *odd])["odd_growth"].split(" 1 fruitlet ")
    assert "left out" in first and "fruitlet 95.0" in first
    assert "falling" in second and "fruitlet 6.0" in second


def test_a_visit_with_half_the_clusters_is_said() -> None:
    half = [
        replace(each, sightings={d: s for d, s in each.sightings.items() if d != on(8)})
        if each.tag_id > 25
        else each
        for each in many_clusters()
    ]
    found = forecast(made_block(half), on(4), on(8))
    texts = {warning.code: warning.text for warning in warnings_about(found)}
    assert "25 on 2026-05-18" in texts["clusters_missed"]
    assert ": 50 of 100 fruitlets;" in texts["many_not_seen"]


@pytest.mark.parametrize("source", SizeSource)
def test_an_empty_first_cell_of_a_table_is_said(source: SizeSource) -> None:
    late = [made_fruitlet(1, name, {4: 11.0, 8: 14.0}) for name in ("late", "later")]
    other = made_fruitlet(60, "a", {4: 11.0, 8: 14.0})
    block = made_block([*many_clusters(), *late, other], source)
    told = {w.code: w.text for w in warnings_about(forecast(block, on(4), on(8)))}
    if source is SizeSource.CAMERA:
        assert "no_first_size" not in told
    else:
        assert "2 fruitlets (fruitlet late of cluster 1, fruitlet later" in told["no_first_size"]


def test_pictures_that_are_not_read_are_no_missing_measurements() -> None:
    block = replace(made_block(many_clusters()), unread={on(8): 1, on(12): 6})
    found = forecast(block, on(4), on(8))
    text = {each.code: each.text for each in warnings_about(found)}["unread_pictures"]
    assert "Pictures of 7 clusters are stored and not read (1 on 2026-05-18" in text
    with pytest.raises(BadInput) as refused:
        chosen_interval(replace(block, visits=block.visits[:1]))
    assert "6 on 2026-05-22" in str(refused.value.hint)


def test_a_cluster_whose_fruitlets_shrank_may_be_another_one() -> None:
    swapped = [made_fruitlet(60, name, {0: 12.0, 4: 15.0, 8: 11.0}) for name in "abc"]
    assert "mixed_up_clusters" in codes(made_block([*many_clusters(), *swapped]), 4, 8)
    one = [made_fruitlet(60, name, {0: 8.0, 4: 11.0, 8: 14.0}) for name in "ab"]
    assert "mixed_up_clusters" not in codes(
        made_block([*many_clusters(), *one, *swapped[:1]]), 4, 8
    )


def test_two_of_four_that_shrank_may_be_of_another_cluster() -> None:
    ends_mm = (8.1, 10.1, 11.2, 13.9)
    swapped = [made_fruitlet(60, str(k), {0: 8.0, 4: 11.0, 8: mm}) for k, mm in enumerate(ends_mm)]
    assert "mixed_up_clusters" in codes(made_block([*many_clusters(), *swapped]), 4, 8)
    assert "mixed_up_clusters" not in codes(made_block([*many_clusters(), *swapped[1:]]), 4, 8)


def test_a_cluster_that_lost_everything_at_once_may_not_have_been_measured() -> None:
    gone = [made_fruitlet(60, name, {0: 8.0, 4: 11.0, 8: FALLEN}) for name in "abc"]
    told = told_of([*many_clusters(), *gone])
    assert "1 cluster" in told["emptied_clusters"] and told["emptied_clusters"].endswith("60.")
    assert "tags_changed" not in told
    left = made_fruitlet(60, "d", {0: 8.0, 4: 11.0, 8: 14.0})
    assert "emptied_clusters" not in told_of([*many_clusters(), *gone, left])
    before = [made_fruitlet(60, name, {0: 8.0, 4: FALLEN, 8: FALLEN}) for name in "abc"]
    assert "emptied_clusters" not in told_of([*many_clusters(), *before])


@pytest.mark.parametrize(
    ("shown", "said"),
    [
        ({0: "abcd", 4: "abcd", 8: "wxyz"}, ["61 on 2026-05-18"]),
        ({0: "abcd", 4: "wxyz", 8: "abcd"}, ["61 on 2026-05-14"]),
        ({0: "wxyz", 4: "abcd", 8: "abcd"}, ["61 on 2026-05-10"]),
        ({0: "abcd", 8: "awxyz"}, ["61 on 2026-05-18"]),
        ({0: "abcd", 8: "abwxyz"}, []),
        ({0: "abcd", 4: "abcd", 8: "x"}, []),
        ({0: "ab", 4: "ab", 8: "xy"}, ["61 on 2026-05-18"]),
        ({0: "abcd", 4: "ab", 8: "b"}, []),
        ({0: "", 4: "abcd", 8: "abcd", 12: "wxyz"}, []),
    ],
)
def test_pictures_of_another_cluster_are_asked_about(
    shown: dict[int, str], said: list[str]
) -> None:
    mm = {0: 8.0, 4: 11.0, 8: 14.0, 12: 17.0}
    odd = [
        made_fruitlet(61, name, {day: mm[day] for day, names in shown.items() if name in names})
        for name in "abcdwxyz"
    ]
    block = made_block([*many_clusters(), *(each for each in odd if each.sightings)])
    found = forecast(replace(block, source=SizeSource.CAMERA), on(4), on(8))
    texts = {warning.code: warning.text for warning in warnings_about(found)}
    text = texts.get("other_clusters", "")
    assert all(words in text for words in said) and text.count(" on 2026") == len(said)
    named = forecast(block, on(4), on(8))
    assert "other_clusters" not in {each.code for each in warnings_about(named)}


def test_a_tag_that_begins_where_another_ends_may_hang_at_its_cluster() -> None:
    gone = [made_fruitlet(60, name, {0: 8.0, 4: 11.0, 8: FALLEN}) for name in "abc"]
    new = [made_fruitlet(61, name, {8: 14.0}) for name in "abc"]
    assert "Tag 61" in told_of([*many_clusters(), *gone, *new])["tags_changed"]
    assert "tags_changed" not in told_of([*many_clusters(), *new])


def told_of(fruitlets: list[FruitletRecord]) -> dict[str, str]:
    found = forecast(made_block(fruitlets), on(4), on(8))
    return {warning.code: warning.text for warning in warnings_about(found)}


@pytest.mark.parametrize(
    ("days", "said"), [((), False), ((-2,), False), ((0,), True), ((9,), False)]
)
def test_too_soon_after_a_spray(days: tuple[int, ...], said: bool) -> None:
    found = forecast(made_block(many_clusters()), on(4), on(8))
    told = {each.code for each in warnings_about(found, [SprayDay(on(day)) for day in days])}
    assert ("soon_after_spray" in told) is said


@pytest.mark.parametrize(("day", "said"), [(8, False), (9, True)])
def test_a_spray_after_the_visits_is_said(day: int, said: bool) -> None:
    found = forecast(made_block(many_clusters()), on(4), on(8))
    told = {each.code: each.text for each in warnings_about(found, [SprayDay(on(day))])}
    assert ("sprayed_since" in told) is said
    assert str(on(day)) in told.get("sprayed_since", "") or not said


@pytest.mark.parametrize(("fallen", "said"), [(3, False), (4, True)])
def test_a_size_order_forecast_that_is_far_away(fallen: int, said: bool) -> None:
    block = made_block(fast_ones(100))
    other = [
        made_fruitlet(1, str(i), {0: 8.0, 4: FALLEN if i < fallen else 12.0}) for i in range(100)
    ]
    one, by_size = (forecast(b, on(0), on(4)) for b in (block, made_block(other)))
    told = {warning.code for warning in warnings_about(one, by_size_order=by_size)}
    assert ("size_order_differs" in told) is said
