"""The store: a data folder with its database, opened to write.

Image files first, each durable, then one transaction; when `save` returns, no
crash can lose the capture. Threads may share a store: each gets a connection of
its own, so that reading for the screen never waits for writing.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path
from typing import ParamSpec, Self, TypeVar
from weakref import WeakSet, finalize

from sqlite_utils import Database

from fieldcam.errors import StorageError, StorageFull
from fieldcam.store.captures import SavedCapture, camera_facts, keep_image, refuse_other_kind
from fieldcam.store.clock import Moment, now
from fieldcam.store.connection import connect, rows, writing
from fieldcam.store.facts import dump_facts, facts_of
from fieldcam.store.folder import DATABASE_NAME as DATABASE_NAME
from fieldcam.store.folder import DataFolder, DataKind, check_marker, open_data_folder
from fieldcam.store.identity import Identity, identify
from fieldcam.store.journal import Clock, append
from fieldcam.store.lock import FolderLock
from fieldcam.store.migrations import migrate
from fieldcam.store.objects import CALIBRATION_SUFFIX, FACTS_SUFFIX, Objects
from fieldcam.store.queries.imports import has_calibration
from fieldcam.store.recovery.lost_rows import check_rows
from fieldcam.store.rows.judgements import Undo
from fieldcam.store.rows.orchard import Block, Operator, Tree
from fieldcam.store.rows.row import Draft, EntryId, Row, new_id
from fieldcam.store.rows.walk import (
    Capture,
    Event,
    EventKind,
    ObjectFile,
    ObjectRole,
    Visit,
)
from fieldcam.store.space import Space
from fieldcam.values import RawPair

_Given = ParamSpec("_Given")
_Result = TypeVar("_Result")


class Store:
    """An open data folder; `open_store` makes one."""

    def __init__(
        self, folder: DataFolder, lock: FolderLock, space: Space, clock: Clock = now
    ) -> None:
        self.folder = folder
        self.lock = lock
        self.space = space
        self.objects = Objects(folder.path)
        self.database_path = folder.path / DATABASE_NAME
        self.operator: EntryId | None = None
        """Who the rows are written by; None: unknown."""
        self._clock = clock
        self._local = threading.local()
        # SQLite makes a writer that finds the database locked sleep for a while; threads
        # of one store wait for each other here, and not a moment longer than they must.
        self._turn = threading.RLock()
        self._open: WeakSet[Database] = WeakSet()
        try:
            migrate(self.database, self.database_path)
        except StorageFull:
            # Reading takes some room too: SQLite's index of its log lies beside the file.
            if not space.release():
                raise
            migrate(self.database, self.database_path)
        self.identity: Identity = self._with_reserve(lambda: identify(self.database, clock=clock))

    @property
    def database(self) -> Database:
        """The calling thread's connection."""
        found: Database | None = getattr(self._local, "database", None)
        if found is None:
            found = self._local.database = connect(self.database_path)
            self._open.add(found)
            # SQLite keeps every file of a database open while one connection is, and
            # Python alone would close that of a thread that ended only some time later.
            finalize(found, found.conn.close)
        return found

    def append(self, *entries: Row | Draft, why: str | None = None) -> tuple[EntryId, ...]:
        """Write rows in one transaction; when this returns, they are durable.

        On a full disk the reserve is given up for them.
        """
        return self.together(
            lambda: append(
                self.database,
                self.identity.device,
                *entries,
                who=self.operator,
                why=why,
                clock=self._clock,
            )
        )

    def together(
        self, action: Callable[_Given, _Result], *args: _Given.args, **kwargs: _Given.kwargs
    ) -> _Result:
        """All that the action writes in one transaction, which costs the disk one wait.

        On a full disk the reserve is given up and the action called again.
        """

        def in_one() -> _Result:
            with self._turn, writing(self.database):
                return action(*args, **kwargs)

        return self._with_reserve(in_one)

    def undo(self, entry: EntryId, why: str | None = None) -> EntryId:
        """Let a decision, mark, correction, skip or note count no more."""
        return self.append(Undo(entry), why=why)[0]

    def redo(self, entry: EntryId, why: str | None = None) -> EntryId:
        """Let it count again."""
        return self.append(Undo(entry, undone=False), why=why)[0]

    def save(
        self,
        raw: RawPair,
        *,
        visit: EntryId | None = None,
        tag_expected: int | None = None,
        view: int = 1,
        retake_of: EntryId | None = None,
        shutter: Moment | None = None,
        tree: EntryId | None = None,
        calibration: str | None = None,
        followed_by: Callable[[], Sequence[Row]] = tuple,
    ) -> SavedCapture:
        """Make a raw pair durable, with the time and the tree of its shutter where they are known.

        `calibration` is the name that `keep_calibration` gave, where the pair has its own.
        `followed_by` gives the rows that are to stand behind it, once nobody else can write.
        """
        refuse_other_kind(self.folder, raw.simulated)
        self.space.check()
        left, right = keep_image(self.objects, raw.left), keep_image(self.objects, raw.right)
        capture = Capture(
            visit=visit,
            tag_expected=tag_expected,
            view=view,
            retake_of=retake_of,
            left_file=left.name,
            right_file=right.name,
            left_bytes=left.stat().st_size,
            right_bytes=right.stat().st_size,
            calibration=calibration,
            **camera_facts(raw),
        )
        return self.add_capture(capture, shutter, tree, followed_by)

    def keep_calibration(self, content: bytes) -> str:
        """Make a calibration durable and give the name of its file, which has a row of its own."""
        name = self.objects.keep(content, CALIBRATION_SUFFIX).name
        self.together(
            self._name_calibration, ObjectFile(name, len(content), ObjectRole.CALIBRATION)
        )
        return name

    def add_capture(
        self,
        capture: Capture,
        shutter: Moment | None = None,
        tree: EntryId | None = None,
        followed_by: Callable[[], Sequence[Row]] = tuple,
    ) -> SavedCapture:
        """Write the row of a pair whose image files are durable already, its facts before it."""
        refuse_other_kind(self.folder, capture.simulated)
        draft = Draft(capture, new_id())
        facts = facts_of(self.database, draft.id, capture, shutter)
        self._with_reserve(lambda: self.objects.keep(dump_facts(facts), FACTS_SUFFIX))
        event = Event(EventKind.SHUTTER, capture.visit, draft.id, capture.tag_expected, tree)
        shots = () if shutter is None else (Draft(event, new_id(), shutter),)
        self.together(lambda: self.append(draft, *shots, *followed_by()))
        return SavedCapture(
            draft.id,
            self.objects.path(capture.left_file),
            self.objects.path(capture.right_file),
            self.database_path,
            None if capture.calibration is None else self.objects.path(capture.calibration),
        )

    def sign_in(self, name: str) -> EntryId:
        """Rows are by this operator from now on."""
        self.operator = self._known_or_new(Operator(name), "name = ?", name)
        return self.operator

    def block(self, block: Block) -> EntryId:
        """The block of this name, made when it is new."""
        if not block.name.strip():
            raise StorageError("A block needs a name.")
        return self._known_or_new(block, "name = ?", block.name)

    def tree(self, block: EntryId, label: str) -> EntryId:
        """The tree of this label, made when it is new."""
        return self._known_or_new(Tree(block, label), "block = ? AND label = ?", block, label)

    def visit(self, block: EntryId, day: date) -> EntryId:
        """The block's visit of this day, made when it is new."""
        where = "id IN (SELECT id FROM visit_now WHERE block = ? AND day = ?)"
        return self._known_or_new(Visit(block, day), where, block, day.isoformat())

    def close(self) -> None:
        """Close all connections; closing twice is fine."""
        for database in tuple(self._open):
            database.close()
        self._local = threading.local()
        self.lock.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _known_or_new(self, row: Row, where: str, *parameters: str) -> EntryId:
        """Looked up and written under one lock, so that two processes make only one."""
        sql = (
            f"SELECT id FROM {row.table} JOIN standing USING (id)"
            f" WHERE {where} ORDER BY turn, id LIMIT 1"
        )

        def look_up_or_append() -> EntryId:
            found = rows(self.database, sql, *parameters)
            return found[0]["id"] if found else self.append(row)[0]

        return self.together(look_up_or_append)

    def _name_calibration(self, row: ObjectFile) -> None:
        """Unless another thread was faster."""
        if not has_calibration(self.database, row.file):
            self.append(row)

    def _with_reserve(self, action: Callable[[], _Result]) -> _Result:
        inside = self.database.conn.in_transaction
        try:
            return action()
        except StorageFull:
            # A transaction that was begun further out cannot be gone on with.
            if inside or not self.space.release():
                raise
            return action()


def open_store(path: Path, kind: DataKind, clock: Clock = now, space: Space | None = None) -> Store:
    """Open the data folder at `path` to write; it is made when it is missing.

    Raises RowsLost before anything is written where its database is not that of its pictures.
    """
    check_marker(path)
    check_rows(path, DATABASE_NAME)
    return open_unchecked(path, kind, clock, space)


def open_unchecked(
    path: Path, kind: DataKind, clock: Clock = now, space: Space | None = None
) -> Store:
    """The same, whatever pictures lie there without a row."""
    folder = open_data_folder(path, kind)
    lock = FolderLock(path)
    space = space or Space(path)
    try:
        store = Store(folder, lock, space, clock)
    except BaseException:
        lock.close()
        raise
    space.set_aside()
    return store
