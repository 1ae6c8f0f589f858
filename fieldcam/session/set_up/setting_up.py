"""What is set up before a walk: who walks, which block, and what is known of it.

Every change is a row, written at once. Methods that change something give the
sentence that tells the operator what was done, or raise BadInput before anything
was written.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import date

from fieldcam.errors import StorageFull
from fieldcam.exchange.route_table import PlannedRoute
from fieldcam.session.deciding.undoing import undo_last_set_up
from fieldcam.session.doubt import NotNow
from fieldcam.session.set_up.planning import keep_route
from fieldcam.session.set_up.today import (
    AnotherDay,
    clock_doubt,
    day_of,
    season_doubt,
    told,
)
from fieldcam.store.clock import now
from fieldcam.store.folder import DataKind
from fieldcam.store.queries.blocks import (
    BlockSummary,
    DayCorrection,
    SprayRecord,
    VisitSummary,
    block_named,
    blocks,
    day_corrections,
    newest_blocks,
    settings,
    sprays,
    tag_size_mm,
    trees,
    visits,
)
from fieldcam.store.queries.calipers import typed_sizes
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.queries.operators import last_operator, operators
from fieldcam.store.queries.resuming import resume
from fieldcam.store.queries.walks import is_planned
from fieldcam.store.rows.judgements import Undo
from fieldcam.store.rows.orchard import Block, BlockFacts, BlockSetting, Setting, Spray, Tree
from fieldcam.store.rows.row import EntryId
from fieldcam.store.rows.walk import Event, EventKind, VisitDay
from fieldcam.store.store import Store
from fieldcam.words import number_of

MAX_TREES = 10_000


@dataclass(frozen=True, slots=True)
class TreeFacts:
    """A tree of the block."""

    id: EntryId
    label: str
    bloom_clusters: float | None
    """Its own count, else the block's."""


@dataclass(frozen=True, slots=True)
class SetUpState:
    """What is set up at one moment; without a block there is nothing after `blocks`."""

    simulated: bool
    free_bytes: int
    day: date
    operator: str | None
    operators: tuple[str, ...]
    block: BlockSummary | None
    blocks: tuple[str, ...]
    trees: tuple[TreeFacts, ...] = ()
    numbers: tuple[tuple[Setting, float], ...] = ()
    """For the block as a whole."""
    sprays: tuple[SprayRecord, ...] = ()
    visits: tuple[VisitSummary, ...] = ()
    """The earliest first."""
    corrections: Mapping[EntryId, DayCorrection] = field(default_factory=dict)
    """Of the days of visits, by visit."""
    planned: bool = False
    """The route was given; else it is learned by walking."""

    def number(self, name: Setting) -> float | None:
        return dict(self.numbers).get(name)


class SetUp:
    """Used by one thread at a time."""

    def __init__(self, store: Store, today: Callable[[], date] | None = None) -> None:
        self._store = store
        self.today = today or (lambda: day_of(now()))
        self.operator: str | None = None
        self.block: EntryId | None = None
        self.visit: EntryId | None = None
        """The visit that is walked; None until one is opened in this block."""
        self._opened_on = self.today()
        """What the clock said when the visit was opened, or kept in spite of another day."""

    def resume(self) -> None:
        """Who walked last, and where; opens today's visit unless the day is doubtful.

        Where no walk goes on, the block is the newest one, such as an import has made.
        """
        name = last_operator(self._store.database, self._store.identity.device)
        if name is not None:
            self._store.sign_in(name)
            self.operator = name
        last = resume(self._store.database)
        newest = newest_blocks(self._store.database)
        self.block = next(iter(newest), None) if last is None else last.block
        if self.block is not None and self.doubt() is None and self.season_doubt() is None:
            # On a full disk there is only a visit to look at that was opened before.
            with suppress(StorageFull):
                self.open_visit(self.today())

    def state(self) -> SetUpState:
        database = self._store.database
        found = blocks(database)
        block = next((each for each in found if each.id == self.block), None)
        state = SetUpState(
            simulated=self._store.folder.kind is DataKind.SIMULATED,
            free_bytes=self._store.space.free_bytes,
            day=self.today(),
            operator=self.operator,
            operators=operators(database),
            block=block,
            blocks=tuple(each.name for each in found),
        )
        return state if block is None else self._with_block(state, block.id)

    def sign_in(self, name: str) -> str:
        """This operator walks from now on."""
        self._store.sign_in(name)
        self._store.append(Event(EventKind.SIGNED_IN))
        self.operator = name
        return f"{name} walks."

    def choose_block(self, name: str) -> str:
        """Walk another block, whose visit is still to be opened."""
        found = block_named(self._store.database, name)
        if found is None:
            raise NotNow(f"There is no block {name}.")
        if found.id != self.block:
            self.block, self.visit = found.id, None
        return f"Block {name}."

    def new_block(self, block: Block) -> str:
        """Make a block and walk it."""
        check_new_block(block.name, [each.name for each in blocks(self._store.database)])
        self.block, self.visit = self._store.block(block), None
        return f"Block {block.name} was made."

    def correct_block(self, orchard: str, variety: str, season: int, why: str = "") -> str:
        """What was said of the block was wrong; its name stays."""
        facts = BlockFacts(self._block(), orchard, variety, season)
        self._store.append(facts, why=why or None)
        return "Written down."

    def set_trees(self, count: int) -> str:
        """The block has this many trees."""
        block = self._block()
        labels = set(trees(self._store.database, block).values())
        check_trees(count, len(labels))
        free = (str(n) for n in range(1, 2 * count + 1) if str(n) not in labels)
        new = [Tree(block, next(free)) for _ in range(count - len(labels))]
        self._store.append(*new)
        return f"The block has {number_of(count, 'tree')}."

    def set_number(self, name: Setting, value: float, tree: EntryId | None = None) -> str:
        """A number for the block, or for one of its trees."""
        self._store.append(BlockSetting(self._block(), name, value, tree))
        return "Written down."

    @property
    def walked(self) -> tuple[EntryId | None, float | None]:
        """The visit, and the size of its cards in mm: where they change, another walk begins."""
        if self.block is None:
            return None, None
        return self.visit, tag_size_mm(self._store.database, self.block)

    def add_spray(self, day: date, product: str, rate: str) -> str:
        self._store.append(Spray(self._block(), day, product, rate))
        return f"{product} on {day} was written down."

    def strike_spray(self, spray: EntryId) -> str:
        """It was written down by mistake."""
        self._store.undo(spray)
        return "The spray was struck out."

    def plan_route(self, route: PlannedRoute) -> str:
        """The block is walked in this order."""
        return keep_route(self._store, self._block(), route)

    def undo(self) -> str:
        """Take back the last change of this block."""
        return undo_last_set_up(self._store, self._block())

    def doubt(self) -> str | None:
        """Why today cannot be trusted: nobody walked so early, or the clock went back."""
        if self._store.folder.kind is DataKind.SIMULATED:
            return None  # no clock says an orchard's made-up days
        day, walked = self.today(), self._days()
        last = resume(self._store.database)
        if day in walked or last is None:
            return clock_doubt(day, () if day in walked else walked)
        return clock_doubt(day, (*walked, last.day))

    def season_doubt(self) -> str | None:
        """Why this block cannot be the one that is walked today."""
        block = row_of(self._store.database, "block", self._block())
        return season_doubt(block["name"], self.today(), self._days())

    def open_visit(self, day: date) -> None:
        """Walk the block on this day, whatever the clock says."""
        self.visit = self._store.visit(self._block(), day)
        self._store.append(Event(EventKind.VISIT_OPENED, self.visit))
        self._opened_on = self.today()

    def another_day(self) -> AnotherDay | None:
        """To be asked about before a picture; any thread may call it."""
        day, visit = self.today(), self.visit
        if visit is None or day == self._opened_on:
            return None
        row = row_of(self._store.database, "visit_now", visit)
        of_visit = date.fromisoformat(row["day"])
        return None if of_visit == day else AnotherDay(of_visit, day)

    def keep_day(self) -> str:
        """The visit goes on, whatever the clock says now."""
        self._opened_on = self.today()
        return "The visit goes on."

    def correct_day(self, visit: EntryId, day: date, why: str = "") -> str:
        """The visit was on another day than it was given, and so were the sizes by caliper."""
        database = self._store.database
        before = date.fromisoformat(row_of(database, "visit_now", visit)["day"])
        if day == before:
            raise NotNow(f"The visit is of {told(day)} already.")
        twice = day in self._days()
        self._store.together(self._correct_day, visit, before, day, why or None)
        said = f"The visit of {told(before)} was on {told(day)}."
        return f"{said} That day has two visits now, which count as one." if twice else said

    def _correct_day(self, visit: EntryId, before: date, day: date, why: str | None) -> None:
        typed = typed_sizes(self._store.database, visit, before)
        rows = [replace(size, day=day) for size in typed.values()]
        self._store.append(VisitDay(visit, day), *rows, *map(Undo, typed), why=why)

    def _days(self) -> tuple[date, ...]:
        return tuple(visit.day for visit in visits(self._store.database, self._block()))

    def _block(self) -> EntryId:
        if self.block is None:
            raise NotNow("Choose a block first, or make one.")
        return self.block

    def _with_block(self, state: SetUpState, block: EntryId) -> SetUpState:
        database = self._store.database
        bloom = Setting.BLOOM_CLUSTERS_PER_TREE
        found = tuple(
            TreeFacts(tree, label, settings(database, block, tree).get(bloom))
            for tree, label in trees(database, block).items()
        )
        return replace(
            state,
            trees=found,
            numbers=tuple(settings(database, block).items()),
            sprays=sprays(database, block),
            visits=visits(database, block),
            corrections=day_corrections(database, block),
            planned=is_planned(database, block),
        )


def check_new_block(name: str, known: Sequence[str]) -> None:
    """Raise NotNow where a block among those that are known has this name."""
    if name in known:
        raise NotNow(f"There is a block {name} already; choose it from the list.")


def check_trees(count: int, known: int) -> None:
    """Raise NotNow where a block of so many known trees cannot have this many."""
    if count < known:
        raise NotNow(f"The block has {number_of(known, 'tree')} already.")
    if count > MAX_TREES:
        raise NotNow(f"A block has at most {MAX_TREES} trees.")
