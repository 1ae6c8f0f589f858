"""A block whose fruitlets are told apart by their sizes alone."""

from __future__ import annotations

from made_records import FALLEN, NOT_SEEN, SEEN, Known, made_block, made_fruitlet, on

from fieldcam.growth.records import BlockRecord
from fieldcam.growth.size_order import in_size_order


def rows_of(block: BlockRecord) -> dict[tuple[int, str], list[Known]]:
    """What is known of each fruitlet, visit by visit."""
    return {
        (each.tag_id, each.fruitlet): [
            seen.diameter_mm or seen.presence
            for day in block.visits
            if (seen := each.sightings.get(day)) is not None
        ]
        for each in block.fruitlets
    }


def test_the_largest_of_each_visit_are_taken_for_the_same() -> None:
    block = made_block(
        [
            made_fruitlet(1, "a", {0: 9.0, 4: 9.5, 8: 10.0}),
            made_fruitlet(1, "b", {0: 8.0, 4: NOT_SEEN, 8: 13.0}),
            made_fruitlet(1, "c", {0: 7.0, 4: 10.0, 8: SEEN}),
            made_fruitlet(1, "d", {0: 6.0, 4: FALLEN, 8: FALLEN}),
            made_fruitlet(2, "a", {0: 5.0, 4: 6.0, 8: FALLEN}),
        ]
    )
    assert rows_of(in_size_order(block)) == {
        (1, "1"): [9.0, 10.0, 13.0],
        (1, "2"): [8.0, 9.5, 10.0],
        (1, "3"): [7.0, NOT_SEEN, SEEN],
        (1, "4"): [6.0, FALLEN, FALLEN],
        (2, "1"): [5.0, 6.0, FALLEN],
    }


def test_who_came_later_has_the_last_rank() -> None:
    block = made_block([made_fruitlet(1, "a", {0: 9.0, 4: 9.5}), made_fruitlet(1, "b", {4: 12.0})])
    first, second = in_size_order(block).fruitlets
    assert {day: seen.diameter_mm for day, seen in first.sightings.items()} == {
        on(0): 9.0,
        on(4): 12.0,
    }
    assert set(second.sightings) == {on(4)}
