"""Writes what happens on one visit into the store."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import FieldcamError
from fieldcam.store.captures import SavedCapture
from fieldcam.store.clock import now
from fieldcam.store.queries.walks import expectation
from fieldcam.store.readings import reading_row
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.row import EntryId
from fieldcam.store.rows.walk import AnalysisFailure
from fieldcam.store.store import Store
from fieldcam.values import Expectation, RawPair


@dataclass(frozen=True, slots=True)
class StoredVisit:
    """One visit of a block in an open store."""

    store: Store
    visit: EntryId
    calibration: str | None = None
    """The kept file of what its pictures are taken with, where that is known."""

    def expectation(self, tag_id: int) -> Expectation:
        """What is known about a cluster from its last accepted visit."""
        return expectation(self.store.database, self.visit, tag_id)

    def save(self, raw: RawPair, expectation: Expectation) -> SavedCapture:
        """Make the pair durable; the shutter's time is that of this call."""
        return self.store.save(
            raw,
            visit=self.visit,
            tag_expected=expectation.tag_id,
            shutter=now(),
            calibration=self.calibration,
        )

    def keep(self, saved: SavedCapture, reading: EncodedReading, duration_ms: float) -> None:
        """Keep a reading of a saved pair."""
        self.store.append(reading_row(saved.key, reading, duration_ms))

    def fail(self, saved: SavedCapture, error: FieldcamError) -> None:
        """Keep why a saved pair has no reading."""
        self.store.append(AnalysisFailure(saved.key, type(error).__name__, error.message))

    def accept(self, saved: SavedCapture) -> None:
        """The operator's word that this picture counts."""
        self.store.append(Decision(saved.key, Action.ACCEPT))
