"""Brings recorded pairs into the store: each is kept first, and then analysed.

It may be cut off at any moment and run again: a pair is known by its files'
content, and one that was kept without a reading is analysed now.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from time import perf_counter

from fieldcam.errors import AnalysisOff, BadInput, FieldcamError
from fieldcam.exchange.capture_folder import CaptureFile
from fieldcam.exchange.pair_files import read_pair_files
from fieldcam.session.intake import Fate, Intake
from fieldcam.session.recording import StoredVisit
from fieldcam.session.walk import Analyst
from fieldcam.store.captures import SavedCapture, refuse_other_kind
from fieldcam.store.imports import failed_alike
from fieldcam.store.judgement_rows import Action, Decision
from fieldcam.store.orchard_rows import Block
from fieldcam.store.readings import reading_row
from fieldcam.store.store import Store
from fieldcam.values import ClusterReading, Status, Verdict

OPERATOR = "import"


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one pair."""

    file: CaptureFile
    fate: Fate
    verdict: Verdict | None = None
    """None where it was not analysed now."""
    problem: str = ""
    """Why it was skipped, or has no reading."""

    @property
    def status(self) -> Status | None:
        """The verdict's."""
        return None if self.verdict is None else self.verdict.status


def import_pairs(
    store: Store, block: Block, analyst: Analyst, files: Iterable[CaptureFile]
) -> Iterator[Outcome]:
    """One outcome for each pair; earlier days are to come first, as later ones build on them.

    Errors of the store end it, and so does an analysis that is off for good.
    """
    refuse_other_kind(store.folder, simulated=False)
    store.sign_in(OPERATOR)
    intake = Intake(store, block)
    for file in files:
        yield _import_pair(intake, analyst, file)


def _import_pair(intake: Intake, analyst: Analyst, file: CaptureFile) -> Outcome:
    try:
        pair = read_pair_files(file)
    except BadInput as error:
        return Outcome(file, Fate.SKIPPED, problem=str(error))
    taken = intake.take(file, pair)
    if taken.unread is None:
        return Outcome(file, taken.fate, problem=taken.problem)
    visit = StoredVisit(intake.store, intake.visit(file.day))
    started = perf_counter()
    try:
        reading = analyst.analyse(taken.unread, visit.expectation(file.tag_id))
    except AnalysisOff:
        raise
    except FieldcamError as error:
        return Outcome(file, taken.fate, problem=_failed(visit, taken.unread, error))
    _keep(intake.store, taken.unread, reading, (perf_counter() - started) * 1000)
    return Outcome(file, taken.fate, reading.verdict)


def _keep(store: Store, saved: SavedCapture, reading: ClusterReading, duration_ms: float) -> None:
    """The reading and its acceptance are one, so that no crash comes between them."""
    rows = reading_row(saved.key, reading, duration_ms), Decision(saved.key, Action.ACCEPT)
    retake = reading.verdict.status is Status.RETAKE
    store.append(*(rows[:1] if retake else rows))


def _failed(visit: StoredVisit, saved: SavedCapture, error: FieldcamError) -> str:
    """Keeps the reason, once however often the import is run."""
    database = visit.store.database
    if not failed_alike(database, saved.key, type(error).__name__, error.message):
        visit.fail(saved, error)
    return f"It is stored, but was not analysed: {error.message}"
