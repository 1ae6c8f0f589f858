"""Keeps the files of recorded pairs, each under its cluster's name and once only."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import date
from enum import StrEnum

from fieldcam.exchange.capture_folder import CaptureFile
from fieldcam.exchange.pair_files import PairFiles
from fieldcam.store.captures import SavedCapture
from fieldcam.store.connection import writing
from fieldcam.store.queries.imports import (
    KnownPair,
    has_cluster,
    is_untouched,
    known_pairs,
)
from fieldcam.store.queries.resuming import saved_capture
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.orchard import Block, Cluster
from fieldcam.store.rows.row import EntryId
from fieldcam.store.rows.walk import Capture, Event, EventKind
from fieldcam.store.store import Store


class Fate(StrEnum):
    """What became of a pair's files."""

    ADDED = "added"
    KNOWN = "known"
    """They were in the store before."""
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class StoredPair:
    """A pair as the store has it now."""

    fate: Fate
    unread: SavedCapture | None = None
    """Where it has no reading yet."""
    problem: str = ""
    """Why it was skipped."""
    mended: int = 0
    """Images whose copy in the data folder was damaged."""
    read: EntryId | None = None
    """The capture, where it has a reading."""


@dataclass(frozen=True, slots=True)
class Intake:
    """Takes pairs into one block of an open store, which is made for the first that is added."""

    store: Store
    block: Block

    def take(self, file: CaptureFile, pair: PairFiles) -> StoredPair:
        """Make a pair durable, unless it is known."""
        self.store.space.check()
        objects = self.store.objects
        eyes = [(objects.name(eye.content, eye.suffix), eye) for eye in (pair.left, pair.right)]
        mended = sum(objects.is_damaged(name) for name, _ in eyes)
        left, right = (objects.keep(eye.content, eye.suffix).name for _, eye in eyes)
        return replace(self._taken(file, pair, left, right), mended=mended)

    def _taken(self, file: CaptureFile, pair: PairFiles, left: str, right: str) -> StoredPair:
        # Under the write lock, so that two imports of one folder add each pair once.
        with writing(self.store.database):
            known = known_pairs(self.store.database, left, right)
            for each in known:
                if each.is_of(self.block.name, file.day, file.tag_id):
                    return self._known(each)
            for each in known:
                if each.stands:
                    return StoredPair(Fate.SKIPPED, problem=_stored_as(file, each))
            self._tidy(known)
            self._learn(file.tag_id)
            capture = self._capture(file, pair, left, right)
            return StoredPair(Fate.ADDED, self.store.add_capture(capture))

    def visit(self, day: date) -> EntryId:
        """The block's visit of this day; one that only the import made is over at once."""
        visit = self.store.visit(self.store.block(self.block), day)
        if is_untouched(self.store.database, visit):
            self.store.append(Event(EventKind.VISIT_ENDED, visit))
        return visit

    def _known(self, pair: KnownPair) -> StoredPair:
        if pair.analysed or pair.discarded:
            return StoredPair(Fate.KNOWN, read=pair.capture if pair.analysed else None)
        return StoredPair(Fate.KNOWN, saved_capture(self.store.database, pair.capture))

    def _tidy(self, known: tuple[KnownPair, ...]) -> None:
        """What was taken up of these files after a crash, without a tag, counts no more."""
        left_over = (each.capture for each in known if not each.discarded)
        for capture in left_over:
            self.store.append(Decision(capture, Action.DISCARD), why="it was imported")

    def _learn(self, tag_id: int) -> None:
        """A tag of which there are pictures belongs to the block."""
        block = self.store.block(self.block)
        if not has_cluster(self.store.database, block, tag_id):
            self.store.append(Cluster(block, tag_id))

    def _capture(self, file: CaptureFile, pair: PairFiles, left: str, right: str) -> Capture:
        return Capture(
            visit=self.visit(file.day),
            tag_expected=file.tag_id,
            view=file.view,
            retake_of=None,
            left_file=left,
            right_file=right,
            left_bytes=len(pair.left.content),
            right_bytes=len(pair.right.content),
            pixel_format=pair.pixel_format.value,
            taken_at=file.local_time.isoformat(),
            left_timestamp_ns=0,
            right_timestamp_ns=0,
            left_serial="",
            right_serial="",
            trigger_ordinal=0,
            simulated=False,
            source=str(file.left.absolute()),
            calibration=self.store.keep_calibration(pair.calibration),
        )


def _stored_as(file: CaptureFile, pair: KnownPair) -> str:
    where = f"tag {pair.tag_expected} of {pair.day}, block {pair.block_name}"
    return f"{file.left.name} and {file.right.name} are stored already, as {where}."
