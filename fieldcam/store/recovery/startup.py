"""What is checked when the app starts, and what a screen says about it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from fieldcam.disk.durable import storage_error
from fieldcam.errors import StorageFull
from fieldcam.store.clock import now
from fieldcam.store.connection import rows
from fieldcam.store.facts import all_facts
from fieldcam.store.journal import Clock
from fieldcam.store.recovery.integrity import FileFault, FileProblem, check_files, quick_check
from fieldcam.store.recovery.orphans import adopt_pairs, keep_loose, orphans, sweep
from fieldcam.store.recovery.rebuilding import rebuild
from fieldcam.store.rows.row import EntryId
from fieldcam.store.seals import (
    DamagedReading,
    damage_sentence,
    damaged_readings,
    leave_out,
)
from fieldcam.store.store import Store
from fieldcam.words import number_of

CLOCK_TOLERANCE = timedelta(minutes=2)
MAX_NAMED = 5
TO_DO = "Copy them back from another copy of this data folder; sizes that were read are kept."


@dataclass(frozen=True, slots=True)
class TakenUp:
    """What a crash had left behind."""

    swept: int = 0
    """Temporary files, deleted."""
    captures: tuple[EntryId, ...] = ()
    """Pairs of files that had no row."""
    loose: tuple[str, ...] = ()
    """Single files that had no row."""
    broken: tuple[FileProblem, ...] = ()
    """Files without a row whose content is not what their name says; left alone."""
    left: int = 0
    """Files that wait for a start with room on the disk."""


@dataclass(frozen=True, slots=True)
class StartupReport:
    """The state of a data folder; a damaged database raises StorageDamaged instead."""

    taken_up: TakenUp
    in_use: bool
    """Another program writes here, so what a crash left was not looked for."""
    problems: tuple[FileProblem, ...]
    """Files that are missing or changed."""
    copied: bool
    """The folder comes from another machine, or its disk was cloned."""
    clock_behind: timedelta | None
    """How far the clock is before the newest row, where it is."""
    damaged: tuple[DamagedReading, ...]
    """Readings that were left out now."""
    reserve: bool
    """Whether room is set aside for the last rows before the disk is full."""
    no_room: str
    """Why no picture can be begun; empty where one can."""

    @property
    def sentences(self) -> tuple[str, ...]:
        """One for each thing that the operator should know; none when all is well."""
        taken = len(self.taken_up.captures)
        said = f"Pictures taken up that a crash had left without a row: {taken}."
        return (said, *self.beside_pictures) if taken else self.beside_pictures

    @property
    def beside_pictures(self) -> tuple[str, ...]:
        """The same, but for the pictures that were taken up."""
        return tuple(_sentences(self))


def startup_check(store: Store, clock: Clock = now) -> StartupReport:
    """Check the database and the files, and take up what a crash left behind."""
    quick_check(store.database)
    with store.lock.alone() as alone:
        taken_up = _take_up(store) if alone else TakenUp()
    return StartupReport(
        taken_up=taken_up,
        in_use=not alone,
        problems=check_files(store.database, store.objects),
        damaged=leave_out_damaged(store),
        copied=store.identity.copied,
        clock_behind=_clock_behind(store, clock),
        reserve=store.space.set_aside(),
        no_room=_no_room(store),
    )


def leave_out_damaged(store: Store) -> tuple[DamagedReading, ...]:
    """Readings that are damaged, which count no more once this returns."""
    found = damaged_readings(store.database)
    # On a full disk they are left out where they are met.
    with suppress(StorageFull):
        store.together(leave_out, store.database, store.identity.device, found)
    return found


def _take_up(store: Store) -> TakenUp:
    try:
        swept = sweep(store.folder.path)
        found = orphans(store)
        intact = [path for path in found if store.objects.is_intact(path.name)]
        broken = [
            FileProblem(None, p.name, FileFault.CHANGED) for p in found if p not in set(intact)
        ]
        try:
            rebuilt = rebuild(store, all_facts(store.objects)) if intact else ()
            left_over = set(orphans(store))
            paired = adopt_pairs(store, (path for path in intact if path in left_over))
            left_over = set(orphans(store))
            loose = keep_loose(store, (path for path in intact if path in left_over))
        except StorageFull:
            # What was taken up before is known next time; the rest can wait.
            return TakenUp(swept, broken=tuple(broken), left=len(orphans(store)) - len(broken))
    except OSError as error:
        raise storage_error(Path(error.filename or store.folder.path), error) from error
    return TakenUp(swept, rebuilt + paired, loose, tuple(broken))


def _no_room(store: Store) -> str:
    try:
        store.space.check()
    except StorageFull as full:
        return str(full)
    return ""


def _clock_behind(store: Store, clock: Clock) -> timedelta | None:
    newest = rows(store.database, "SELECT max(at_utc) AS at FROM entry")[0]["at"]
    behind = datetime.fromisoformat(newest) - clock().utc
    return behind if behind > CLOCK_TOLERANCE else None


def _sentences(report: StartupReport) -> Iterator[str]:
    taken_up = report.taken_up
    if taken_up.loose:
        yield f"Single images kept without their other eye: {len(taken_up.loose)}."
    broken = [*taken_up.broken, *(p for p in report.problems if p.fault is FileFault.CHANGED)]
    if broken:
        yield f"Image files that are not what was saved: {len(broken)}, {_of(broken)}. {TO_DO}"
    missing = [p for p in report.problems if p.fault is FileFault.MISSING]
    if missing:
        yield f"Image files that are missing: {len(missing)}, {_of(missing)}. {TO_DO}"
    if report.damaged:
        yield f"{damage_sentence(report.damaged)} Their pictures are read again."
    if report.copied:
        yield "This data folder comes from another machine; its rows are counted anew here."
    if taken_up.left:
        images = number_of(taken_up.left, "image")
        yield f"The disk is full: {images} that a crash had left without a row can wait for room."
    if report.clock_behind is not None:
        hours = report.clock_behind.total_seconds() / 3600
        yield f"The clock is {hours:.1f} h before the newest picture: set it before the walk."
    if report.in_use:
        yield "Another fieldcam has this data folder open."
    if report.no_room:
        yield report.no_room
    elif not report.reserve:
        yield "The disk is nearly full."


def _of(problems: Sequence[FileProblem]) -> str:
    """Whose files these are; the first few."""
    owners = list(dict.fromkeys(problem.belongs_to for problem in problems))
    more = f" and {len(owners) - MAX_NAMED} more" if len(owners) > MAX_NAMED else ""
    return f"of {', '.join(owners[:MAX_NAMED])}{more}"
