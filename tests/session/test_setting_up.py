"""What is set up before a walk: every change is a row, and the next start finds it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import pytest
from stored_walks import FIRST_DAY, small_store

from fieldcam.errors import BadInput, StorageFull
from fieldcam.exchange.route_table import read_route
from fieldcam.session.set_up.setting_up import SetUp, SetUpState
from fieldcam.session.set_up.today import AnotherDay, day_of
from fieldcam.store.clock import Moment
from fieldcam.store.connection import rows
from fieldcam.store.queries.walks import walk_route
from fieldcam.store.rows.orchard import Block, Setting
from fieldcam.store.rows.walk import Event, EventKind
from fieldcam.store.store import Store

BLOOM, TARGET = Setting.BLOOM_CLUSTERS_PER_TREE, Setting.TARGET_FRUIT_PER_TREE


class Told:
    """A set-up whose day can be told."""

    def __init__(self, store: Store) -> None:
        self.store, self.day = store, FIRST_DAY
        self.setup = SetUp(store, lambda: self.day)

    def again(self) -> SetUp:
        """As the app finds it at its next start."""
        self.store.operator = None
        self.setup = SetUp(self.store, lambda: self.day)
        self.setup.resume()
        return self.setup


@pytest.fixture
def told(tmp_path: Path) -> Iterator[Told]:
    with small_store(tmp_path) as store:
        yield Told(store)


@pytest.fixture
def north(told: Told) -> SetUp:
    told.setup.new_block(Block("North", "Home", "Gala", 2026))
    return told.setup


def test_at_first_nothing_is_set_up(told: Told) -> None:
    setup = told.again()
    state = setup.state()
    assert (setup.block, setup.visit, setup.operator, state.block) == (None, None, None, None)
    with pytest.raises(BadInput, match="Choose a block first"):
        setup.set_trees(3)
    with pytest.raises(BadInput, match="Choose a block first"):
        setup.undo()


def test_it_resumes_with_operator_block_and_visit(told: Told) -> None:
    told.setup.sign_in("Ana")
    told.setup.sign_in("Bo")
    told.setup.sign_in("Ana")
    told.setup.new_block(Block("South"))
    told.setup.open_visit(FIRST_DAY)
    told.setup.new_block(Block("North"))
    told.setup.open_visit(FIRST_DAY)
    told.setup.choose_block("South")
    told.setup.open_visit(FIRST_DAY)
    visit = told.setup.visit
    setup = told.again()
    state = setup.state()
    assert state.block is not None
    assert (state.operator, state.block.name, setup.visit) == ("Ana", "South", visit)
    assert (state.operators, state.blocks) == (("Ana", "Bo"), ("North", "South"))
    assert told.store.operator is not None


@pytest.mark.parametrize("imported", [True, False])
def test_a_block_is_remembered_that_nobody_has_walked(
    told: Told, north: SetUp, imported: bool
) -> None:
    assert north.block is not None
    if imported:
        visit = told.store.visit(north.block, FIRST_DAY)
        told.store.append(Event(EventKind.VISIT_ENDED, visit))
        told.day += timedelta(days=3)
    setup = told.again()
    assert setup.block == north.block and setup.visit is not None


def test_a_full_disk_stops_no_start(
    told: Told, north: SetUp, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise StorageFull("No room is left.")

    north.sign_in("Ana")
    north.open_visit(FIRST_DAY)
    with monkeypatch.context() as patch:
        patch.setattr(told.store, "append", full)
        setup = told.again()
        assert (setup.operator, setup.visit) == ("Ana", north.visit)
        told.day += timedelta(days=1)
        setup = told.again()
        assert (setup.block, setup.visit) == (north.block, None)


def test_the_next_day_gets_a_visit_of_its_own(told: Told, north: SetUp) -> None:
    north.open_visit(FIRST_DAY)
    told.day += timedelta(days=3)
    setup = told.again()
    days = rows(told.store.database, "SELECT day FROM visit ORDER BY day")
    assert [row["day"] for row in days] == ["2026-05-21", "2026-05-24"]
    assert setup.visit != north.visit


def test_an_earlier_day_than_the_last_visit_is_asked_about(told: Told, north: SetUp) -> None:
    north.open_visit(FIRST_DAY)
    told.day -= timedelta(days=14)
    setup = told.again()
    assert (setup.block, setup.visit) == (north.block, None)
    doubt = setup.doubt()
    assert doubt is not None
    assert doubt.startswith("The clock says 07 May 2026, but the last visit was on 21 May 2026.")
    setup.open_visit(told.day)
    assert setup.doubt() is None and told.again().visit is not None


@pytest.mark.parametrize("day", [date(2000, 1, 1), date(1970, 1, 1), date(2026, 4, 30)])
def test_a_day_before_this_version_is_asked_about(told: Told, north: SetUp, day: date) -> None:
    """On the first walk, and at each start: a flat battery sets every day to the same one."""
    told.day = day
    for _ in range(2):
        setup = told.again()
        doubt = setup.doubt()
        assert setup.visit is None and doubt is not None
        assert doubt.startswith(f"The clock says {day:%d %b %Y}, which is before this version")
        setup.open_visit(day)


def test_a_block_of_another_season_is_asked_about(told: Told, north: SetUp) -> None:
    north.open_visit(FIRST_DAY)
    told.day += timedelta(days=150)
    assert told.again().visit is not None
    told.day += timedelta(days=200)
    setup = told.again()
    assert setup.visit is None and setup.doubt() is None
    question = setup.season_doubt()
    assert question is not None and question.startswith("Block North was last walked on 18 Oct")


def test_the_calendar_may_go_on_while_a_visit_is_walked(told: Told, north: SetUp) -> None:
    north.open_visit(FIRST_DAY)
    assert north.another_day() is None
    told.day += timedelta(days=4)
    assert north.another_day() == AnotherDay(FIRST_DAY, FIRST_DAY + timedelta(days=4))
    north.keep_day()
    assert north.another_day() is None
    told.day += timedelta(days=1)
    assert north.another_day() is not None
    told.day = FIRST_DAY
    assert north.another_day() is None, "the clock was put right"


def test_a_clock_that_the_operator_overruled_is_not_asked_about(told: Told, north: SetUp) -> None:
    told.day = date(2000, 1, 1)
    north.open_visit(FIRST_DAY)
    assert north.another_day() is None


@pytest.mark.parametrize(
    ("hour", "minute", "expected"),
    [(23, 30, FIRST_DAY), (3, 59, FIRST_DAY), (4, 0, FIRST_DAY + timedelta(days=1))],
)
def test_a_walk_past_midnight_stays_one_visit(hour: int, minute: int, expected: date) -> None:
    day = FIRST_DAY if hour == 23 else FIRST_DAY + timedelta(days=1)
    local = datetime(day.year, day.month, day.day, hour, minute, tzinfo=UTC)
    assert day_of(Moment(local - timedelta(hours=2), 120, "boot", 0)) == expected


def test_trees_numbers_and_sprays(told: Told, north: SetUp) -> None:
    north.set_trees(3)
    trees = north.state().trees
    north.set_number(BLOOM, 120)
    north.set_number(BLOOM, 95, trees[1].id)
    north.set_number(TARGET, 40)
    north.add_spray(FIRST_DAY, "Brevis", "2.2 kg/ha")
    north.add_spray(FIRST_DAY, "Mistake", "")
    north.strike_spray(north.state().sprays[1].id)
    state = north.state()
    assert [(t.label, t.bloom_clusters) for t in state.trees] == [("1", 120), ("2", 95), ("3", 120)]
    assert (state.number(BLOOM), state.number(TARGET)) == (120, 40)
    assert [(s.product, s.rate) for s in state.sprays] == [("Brevis", "2.2 kg/ha")]
    with pytest.raises(BadInput, match="The block has 3 trees already"):
        north.set_trees(2)


def route_file(folder: Path, text: str = "tree,tag\nA,5\nA,3\nB,8\n") -> Path:
    path = folder / "route.csv"
    path.write_text(text)
    return path


def test_a_route_is_one_change(told: Told, north: SetUp, tmp_path: Path) -> None:
    assert north.plan_route(read_route(route_file(tmp_path))) == "The route has 3 tags in 2 trees."
    north.open_visit(FIRST_DAY)
    assert north.visit is not None
    route = walk_route(told.store.database, north.visit)
    assert [(s.tree_label, s.tag_id) for s in route.stops] == [("A", 5), ("A", 3), ("B", 8)]
    assert route.planned
    assert "the route" in north.undo()
    state = north.state()
    assert (state.trees, state.planned) == ((), False)
    assert walk_route(told.store.database, north.visit).stops == ()
    with pytest.raises(BadInput, match="nothing to undo"):
        north.undo()


CHANGES: dict[str, Callable[[SetUp], object]] = {
    "the block's facts": lambda setup: setup.correct_block("Away", "Fuji", 2025),
    "the trees": lambda setup: setup.set_trees(4),
    "the number": lambda setup: setup.set_number(TARGET, 40),
    "the spray": lambda setup: setup.add_spray(FIRST_DAY, "Brevis", ""),
    "the visit's day": lambda setup: setup.correct_day(
        setup.state().visits[0].id, date(2026, 6, 1)
    ),
}


@pytest.mark.parametrize("name", CHANGES)
def test_every_change_can_be_undone(north: SetUp, name: str) -> None:
    north.open_visit(FIRST_DAY)
    before = facts(north)
    CHANGES[name](north)
    assert facts(north) != before
    assert north.undo() == f"Undone: {name}."
    assert facts(north) == before


def facts(setup: SetUp) -> SetUpState:
    return replace(setup.state(), free_bytes=0)


def test_undoing_stays_in_its_block(told: Told, north: SetUp) -> None:
    north.set_trees(2)
    north.new_block(Block("South"))
    with pytest.raises(BadInput, match="nothing to undo"):
        north.undo()
    north.choose_block("North")
    assert north.undo() == "Undone: the trees."


def test_names_of_blocks_are_not_given_twice(north: SetUp) -> None:
    with pytest.raises(BadInput, match="There is a block North already"):
        north.new_block(Block("North"))
    with pytest.raises(BadInput, match="There is no block East"):
        north.choose_block("East")
