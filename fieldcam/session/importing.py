"""Brings recorded pairs into the store: each is kept first, and then analysed.

It may be cut off at any moment and run again: a pair is known by its files'
content, and one that was kept without a reading is analysed now.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from time import perf_counter

from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import AnalysisFailed, AnalysisOff, BadInput, FieldcamError
from fieldcam.exchange.capture_folder import NO_CHECKSUMS, CaptureFile
from fieldcam.exchange.checksums import Checksums
from fieldcam.exchange.pair_files import PairFiles, read_pair_files
from fieldcam.session.intake import Fate, Intake, Taken
from fieldcam.session.recording import StoredVisit
from fieldcam.session.walk import Analyst
from fieldcam.store.captures import SavedCapture, refuse_other_kind
from fieldcam.store.queries.blocks import tag_size_mm as size_of_cards
from fieldcam.store.queries.history import capture_record
from fieldcam.store.queries.imports import failed_alike
from fieldcam.store.readings import reading_row
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.orchard import Block, BlockSetting, Setting
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store
from fieldcam.values import Status, Verdict

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
    unread: bool = False
    """It is stored, and could not be read just now."""
    mended: int = 0
    """Of its images, those whose copy in the data folder was damaged."""

    @property
    def status(self) -> Status | None:
        """The verdict's."""
        return None if self.verdict is None else self.verdict.status


@dataclass(frozen=True, slots=True)
class ImportTerms:
    """How a folder's pairs are taken in."""

    checksums: Checksums = NO_CHECKSUMS
    """What the images' content has to be."""
    accepting: Collection[Status] = (Status.ACCEPT,)
    """Pictures of other verdicts wait for a decision."""
    tag_size_mm: float | None = None
    """Kept as that of the block's cards; None: what is set up holds."""


def import_pairs(
    store: Store,
    block: Block,
    analyst: Analyst,
    files: Iterable[CaptureFile],
    terms: ImportTerms | None = None,
) -> Iterator[Outcome]:
    """One outcome for each pair; earlier days are to come first, as later ones build on them.

    Errors of the store end it, and so does an analysis that is off for good.
    """
    refuse_other_kind(store.folder, simulated=False)
    store.sign_in(OPERATOR)
    terms = terms or ImportTerms()
    if terms.tag_size_mm is not None:
        _set_up_cards(store, store.block(block), terms.tag_size_mm)
    intake = Intake(store, block)
    analysed = partial(_analysed, intake, analyst, terms.accepting)
    late: list[tuple[CaptureFile, Taken]] = []
    for file in files:
        try:
            pair = _read_files(file, terms.checksums)
        except BadInput as error:
            yield Outcome(file, Fate.SKIPPED, problem=str(error))
            continue
        taken = intake.take(file, pair)
        try:
            yield analysed(file, taken)
        except AnalysisOff:
            raise
        except AnalysisFailed:
            late.append((file, taken))
    # A machine that was busy may have time now.
    for file, taken in late:
        try:
            yield analysed(file, taken)
        except AnalysisOff:
            raise
        except AnalysisFailed as error:
            yield _failed(intake, file, taken, error)


def _set_up_cards(store: Store, block: EntryId, size_mm: float) -> None:
    if size_mm != size_of_cards(store.database, block):
        store.append(BlockSetting(block, Setting.TAG_SIZE_MM, size_mm))


def _read_files(file: CaptureFile, checksums: Checksums) -> PairFiles:
    pair = read_pair_files(file)
    for path, content in pair.contents(file):
        checksums.check(path, content)
    return pair


def _analysed(
    intake: Intake,
    analyst: Analyst,
    accepting: Collection[Status],
    file: CaptureFile,
    taken: Taken,
) -> Outcome:
    """Raises AnalysisFailed where the pair's own files are not at fault."""
    if taken.unread is None:
        _accept_known(intake.store, taken.read, accepting)
        return Outcome(file, taken.fate, problem=taken.problem, mended=taken.mended)
    visit = StoredVisit(intake.store, intake.visit(file.day))
    started = perf_counter()
    try:
        reading = analyst.analyse(taken.unread, visit.expectation(file.tag_id))
    except AnalysisFailed:
        raise
    except FieldcamError as error:
        return _failed(intake, file, taken, error)
    accepted = reading.verdict.status in accepting
    _keep(intake.store, taken.unread, reading, (perf_counter() - started) * 1000, accepted)
    return Outcome(file, taken.fate, reading.verdict, mended=taken.mended)


def _keep(
    store: Store, saved: SavedCapture, reading: EncodedReading, duration_ms: float, accepted: bool
) -> None:
    """The reading and its acceptance are one, so that no crash comes between them."""
    rows = reading_row(saved.key, reading, duration_ms), Decision(saved.key, Action.ACCEPT)
    store.append(*(rows if accepted else rows[:1]))


def _accept_known(store: Store, capture: EntryId | None, accepting: Collection[Status]) -> None:
    """What was read before and waits for a decision."""
    record = None if capture is None else capture_record(store.database, capture)
    if record is None or record.reading is None or record.action is not None:
        return
    if record.reading.status in accepting:
        store.append(Decision(record.id, Action.ACCEPT))


def _failed(intake: Intake, file: CaptureFile, taken: Taken, error: FieldcamError) -> Outcome:
    """Keeps the reason, once however often the import is run."""
    assert taken.unread is not None  # only what is unread is analysed
    visit = StoredVisit(intake.store, intake.visit(file.day))
    capture, cause = taken.unread.key, type(error).__name__
    if not failed_alike(intake.store.database, capture, cause, error.message):
        visit.fail(taken.unread, error)
    problem = f"It is stored, but was not analysed: {error.message}"
    unread = isinstance(error, AnalysisFailed)
    return Outcome(file, taken.fate, problem=problem, unread=unread, mended=taken.mended)
