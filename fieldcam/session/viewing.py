"""Reads the state of a walk out of the store."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import date

from sqlite_utils import Database

from fieldcam.session.state import Shown, WalkState
from fieldcam.session.summary import walk_summary
from fieldcam.store.connection import rows
from fieldcam.store.folder import DataKind
from fieldcam.store.journal import changes
from fieldcam.store.objects import Objects
from fieldcam.store.queries.blocks import trees
from fieldcam.store.queries.durations import visit_times
from fieldcam.store.queries.history import CaptureRecord, ClusterMark, capture_record, cluster_marks
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.queries.resuming import (
    Waiting,
    capture_without_tag,
    count_failed,
    count_unread,
    standing_at,
    waiting_for_analysis,
)
from fieldcam.store.queries.walks import ClusterState, Stop, WalkRoute, expectation, walk_route
from fieldcam.store.read_only import ReadableStore
from fieldcam.store.readings import stored_reading
from fieldcam.store.rows import EntryId
from fieldcam.store.store import Store
from fieldcam.values import ClusterReading, Expectation, PixelFormat

Place = tuple[int | None, EntryId | None]
"""A tag and a tree."""


@dataclass(slots=True)
class VisitView:
    """One visit in a store that is open to be read; used by one thread."""

    store: ReadableStore
    visit: EntryId
    _readings: dict[EntryId, ClusterReading] = field(default_factory=dict)
    """The last one read: a whole reading takes a while to decode."""
    _latest: tuple[tuple[int, ...], WalkRoute, Place] | None = None
    """What the rows were when they were read, and what they said."""

    def standing(self) -> int | None:
        """The tag where the operator stands; None: all are done, or it is not known yet."""
        return self.place()[0]

    def place(self) -> Place:
        """The tag and the tree where the operator stands."""
        return self._now()[1]

    def route(self) -> WalkRoute:
        return self._now()[0]

    def shown(self, tag_id: int | None, route: WalkRoute) -> Shown | None:
        """The last picture of a cluster; without a tag, the last one of which none is known."""
        if tag_id is None:
            capture = capture_without_tag(self.store.database, self.visit)
        else:
            stop = route.stop(tag_id)
            capture = stop.captures[-1] if stop is not None and stop.captures else None
        record = None if capture is None else capture_record(self.store.database, capture)
        return None if record is None else self._shown(record)

    def state(self) -> WalkState:
        """All that the store says; camera and analysis are the session's to add."""
        database, route, (tag_id, tree) = self.store.database, self.route(), self.place()
        visit = row_of(database, "visit_now", self.visit)
        shown = self.shown(tag_id, route)
        ended = tag_id is None and shown is None and bool(route.stops)
        return WalkState(
            block=row_of(database, "block", visit["block"])["name"],
            day=date.fromisoformat(visit["day"]),
            simulated=self.store.folder.kind is DataKind.SIMULATED,
            tag_id=tag_id,
            next_tag=route.next_tag(tag_id),
            progress=None if tag_id is None else route.progress(tag_id),
            before=self.expectation(tag_id).fruitlets,
            shown=shown,
            route=route,
            folder=self.store.folder.path,
            tree=trees(database, visit["block"]).get(tree or "", ""),
            learning=tag_id is None and is_learning(route, tree),
            summary=walk_summary(database, route) if ended else None,
            marks=self.marks(tag_id),
            warnings=tuple(_warnings(shown, route)),
            seconds_per_cluster=visit_times(database, self.visit).median_s,
            free_bytes=self.store.space.free_bytes,
            waiting=count_unread(database, self.visit),
            failed=count_failed(database, self.visit),
        )

    def unread_of_block(self) -> list[tuple[Waiting, Expectation]]:
        """Saved pictures of this block without a reading, with what was expected there.

        An earlier day may have ended before its last pictures were read.
        """
        database, block = (
            self.store.database,
            row_of(self.store.database, "visit", self.visit)["block"],
        )
        visits = {
            row["id"] for row in rows(database, "SELECT id FROM visit WHERE block = ?", block)
        }
        return [
            (picture, expected_at(database, picture.visit, picture.tag_expected))
            for picture in waiting_for_analysis(database)
            if picture.visit is not None and picture.visit in visits
        ]

    def expectation(self, tag_id: int | None) -> Expectation:
        """What is known about a cluster from the last visit."""
        return expected_at(self.store.database, self.visit, tag_id)

    def _now(self) -> tuple[WalkRoute, Place]:
        """Read once for each change: a command and its screen ask for it many times."""
        database = self.store.database
        before = changes(database)
        if self._latest is None or self._latest[0] != before:
            route = walk_route(database, self.visit)
            self._latest = before, route, standing_at(database, route)
        return self._latest[1:]

    def marks(self, tag_id: int | None, visit: EntryId | None = None) -> tuple[ClusterMark, ...]:
        """Fruitlets of a cluster that no picture of this visit, or of that one, shows."""
        if tag_id is None:
            return ()
        on = visit or self.visit
        block = row_of(self.store.database, "visit", on)["block"]
        found = cluster_marks(self.store.database, block, tag_id)
        return tuple(mark for mark in found if mark.visit == on)

    def _shown(self, record: CaptureRecord) -> Shown:
        reading = None if record.reading is None else self._reading(record.reading.id)
        return shown_picture(self.store.database, self.store.objects, record, reading)

    def _reading(self, reading: EntryId) -> ClusterReading:
        if reading not in self._readings:
            self._readings = {reading: stored_reading(self.store.database, reading)}
        return self._readings[reading]


def expected_at(database: Database, visit: EntryId, tag_id: int | None) -> Expectation:
    """What was known about a cluster when it was visited."""
    return Expectation() if tag_id is None else expectation(database, visit, tag_id)


@dataclass(slots=True)
class WalkView(VisitView):
    """One visit in a store that is open to be written too."""

    store: Store


def shown_picture(
    database: Database, objects: Objects, record: CaptureRecord, reading: ClusterReading | None
) -> Shown:
    """A picture with its whole reading, as screens show it."""
    capture = row_of(database, "capture", record.id)
    corrections = "SELECT 1 FROM tag_correction_now WHERE capture = ?"
    return Shown(
        record=record,
        left=objects.path(record.left_file),
        right=objects.path(record.right_file),
        pixel_format=PixelFormat(capture["pixel_format"]),
        reading=reading,
        failure=_failure(database, record.id),
        corrected=bool(rows(database, corrections, record.id)),
    )


def _failure(database: Database, capture: EntryId) -> str:
    sql = (
        "SELECT message FROM analysis_failure JOIN standing USING (id)"
        " WHERE capture = ? ORDER BY turn DESC LIMIT 1"
    )
    found = rows(database, sql, capture)
    return found[0]["message"] if found else ""


def is_learning(route: WalkRoute, tree: EntryId | None) -> bool:
    """Where no cluster is due: whether new ones are to be found, in this tree."""
    return not route.planned or (
        tree is not None and all(stop.tree != tree for stop in route.stops)
    )


def _warnings(shown: Shown | None, route: WalkRoute) -> Iterator[str]:
    if shown is None:
        return
    read, tag_id = shown.wrong_tag, shown.record.tag_id
    if read is None:
        here = None if tag_id is None else route.stop(tag_id)
        if shown.record.tag_expected is None and here is not None and len(here.captures) > 1:
            yield f"Tag {tag_id} was taken already on this visit."
        return
    stop: Stop | None = route.stop(read)
    if stop is None:
        yield f"Tag {read} is not on this route."
    elif stop.state is ClusterState.ACCEPTED:
        yield f"Tag {read} is done already."
