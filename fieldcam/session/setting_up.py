"""What is set up before a walk: who walks, which block, and what is known of it.

Every change is a row, written at once. Methods that change something give the
sentence that tells the operator what was done, or raise BadInput before anything
was written.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import date, datetime, timedelta

from fieldcam.errors import StorageFull
from fieldcam.exchange.capture_folder import recording_day
from fieldcam.exchange.route_table import PlannedRoute
from fieldcam.session.doubt import NotNow
from fieldcam.session.planning import keep_route
from fieldcam.session.undoing import undo_last_set_up
from fieldcam.store.blocks import (
    BlockSummary,
    SprayRecord,
    block_named,
    blocks,
    newest_blocks,
    settings,
    sprays,
    trees,
    visits,
)
from fieldcam.store.clock import Moment, now
from fieldcam.store.folder import DataKind
from fieldcam.store.operators import last_operator, operators
from fieldcam.store.orchard_rows import Block, BlockFacts, BlockSetting, Setting, Spray, Tree
from fieldcam.store.resuming import resume
from fieldcam.store.rows import EntryId
from fieldcam.store.store import Store
from fieldcam.store.walk_rows import Event, EventKind
from fieldcam.store.walks import is_planned
from fieldcam.words import number_of

MOST_TREES = 10_000


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
        if self.block is not None and self.doubt() is None:
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
        """Why today cannot be trusted: the clock says a day before the last visit."""
        day, block = self.today(), self._block()
        known = [visit.day for visit in visits(self._store.database, block)]
        last = resume(self._store.database)
        days = known if last is None else [*known, last.day]
        if day in known or all(each <= day for each in days):
            return None
        return (
            f"The clock says {day:%d %b %Y}, but the last visit was on {max(days):%d %b %Y}."
            f" Is today {day:%d %b %Y}?"
        )

    def open_visit(self, day: date) -> None:
        """Walk the block on this day, whatever the clock says."""
        self.visit = self._store.visit(self._block(), day)
        self._store.append(Event(EventKind.VISIT_OPENED, self.visit))

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
    if count > MOST_TREES:
        raise NotNow(f"A block has at most {MOST_TREES} trees.")


def day_of(moment: Moment) -> date:
    """The day that a walk counts for: one that goes on past midnight stays one visit."""
    local: datetime = moment.utc + timedelta(minutes=moment.utc_offset_min)
    return recording_day(local)
