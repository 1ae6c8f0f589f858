"""Brings recorded pairs into the store: each is kept first, and then analysed.

It may be cut off at any moment and run again: a pair is known by its files'
content, and one that was kept without a reading is analysed now.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

from fieldcam.errors import AnalysisFailed, AnalysisOff, BadInput
from fieldcam.exchange.capture_folder import NO_CHECKSUMS, CaptureFile
from fieldcam.exchange.checksums import Checksums
from fieldcam.exchange.pair_files import PairFiles, read_pair_files
from fieldcam.session.events import VerdictReady
from fieldcam.session.intake import Fate, Intake, StoredPair
from fieldcam.session.reading import Keeping, Pardoned, Reader
from fieldcam.session.viewing import WalkView
from fieldcam.store.captures import refuse_other_kind
from fieldcam.store.queries.blocks import tag_size_mm as size_of_cards
from fieldcam.store.queries.history import capture_record
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
    reader: Reader,
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
    analysed = partial(_analysed, intake, reader, terms.accepting)
    late: list[tuple[CaptureFile, StoredPair]] = []
    for file in files:
        try:
            pair = _read_files(file, terms.checksums)
        except BadInput as error:
            yield Outcome(file, Fate.SKIPPED, problem=str(error))
            continue
        taken = intake.take(file, pair)
        try:
            yield analysed(file, taken, pardoned=(AnalysisFailed,))
        except AnalysisOff:
            raise
        except AnalysisFailed:
            late.append((file, taken))
    # A machine that was busy may have time now.
    yield from (analysed(file, taken) for file, taken in late)


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
    reader: Reader,
    accepting: Collection[Status],
    file: CaptureFile,
    taken: StoredPair,
    pardoned: Pardoned = (),
) -> Outcome:
    """Raises what is pardoned, to be tried once more."""
    if taken.unread is None:
        _accept_known(intake.store, taken.read, accepting)
        return Outcome(file, taken.fate, problem=taken.problem, mended=taken.mended)
    view = WalkView(intake.store, intake.visit(file.day))
    keeping = Keeping(
        intake.store,
        view,
        accepts=lambda _, reading: reading.verdict.status in accepting,
        once=True,
    )
    event = keeping.read(reader, taken.unread, view.expectation(file.tag_id), pardoned)
    if isinstance(event, VerdictReady):
        return Outcome(file, taken.fate, event.verdict, mended=taken.mended)
    problem = f"It is stored, but was not analysed: {event.error.message}"
    unread = isinstance(event.error, AnalysisFailed)
    return Outcome(file, taken.fate, problem=problem, unread=unread, mended=taken.mended)


def _accept_known(store: Store, capture: EntryId | None, accepting: Collection[Status]) -> None:
    """What was read before and waits for a decision."""
    record = None if capture is None else capture_record(store.database, capture)
    if record is None or record.reading is None or record.action is not None:
        return
    if record.reading.status in accepting:
        store.append(Decision(record.id, Action.ACCEPT))
