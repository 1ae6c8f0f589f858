"""`fieldcam import`: a folder of captures into the store, analysed."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json, name
from fieldcam.cli.card_size import add_tag_size
from fieldcam.cli.console import emit, emit_json, narrate
from fieldcam.cli.networks import checked_models
from fieldcam.cli.progress import progress
from fieldcam.errors import BadInput
from fieldcam.values import Status
from fieldcam.words import number_of

if TYPE_CHECKING:
    from sqlite_utils import Database

    from fieldcam.exchange.capture_folder import CaptureFolder, FolderProblem
    from fieldcam.session.importing import Outcome

HOW_TO_DECIDE = (
    "The app asks about them on Two days (V, then T). Run again with --accept-confirm, all are"
    " accepted, and the forecast judges by the pictures what has fallen."
)


def register(commands: Subparsers[Parser]) -> None:
    parser = add_command(commands, "import", "store and analyse a folder of captures", _import)
    parser.add_argument("folder", type=Path, metavar="DIR", help="the folder of captures")
    parser.add_argument(
        "--block",
        type=name,
        required=True,
        metavar="NAME",
        help="whose clusters these are: one variety of one orchard in one season",
    )
    parser.add_argument(
        "--accept-confirm",
        action="store_true",
        help="accept pictures that ask a question too; the forecast then judges by what they"
        " show which fruitlets have fallen",
    )
    add_tag_size(parser)
    add_json(parser)


def _import(arguments: argparse.Namespace) -> None:
    from fieldcam.exchange.capture_folder import read_capture_folder

    found = read_capture_folder(arguments.folder)
    models = checked_models(arguments.data)
    outcomes = tuple(progress(_outcomes(arguments, found), len(found.captures), "capture"))
    problems = _problems(found, outcomes)
    again = _of_verdict(Status.RETAKE, outcomes)
    questions = [] if arguments.accept_confirm else _of_verdict(Status.CONFIRM, outcomes)
    counts = _counts(found, outcomes, len(questions))
    if arguments.json:
        narrate(models.honesty)
        listed = {
            "to_confirm": _entries(questions),
            "to_retake": _entries(again),
            "problems": _entries(problems),
        }
        emit_json({"block": arguments.block, **counts, **listed})
    else:
        lines = [*_lines(arguments, counts), *_listed("To be decided on", arguments, questions)]
        if questions:
            lines += ["", HOW_TO_DECIDE]
        lines += _listed("To be taken again", arguments, again)
        lines += _listed("Problems", arguments, problems)
        emit("\n".join([*lines, "", models.honesty]))
    if counts["skipped"] == counts["pairs"]:
        raise BadInput(f"None of the pairs in {arguments.folder} could be imported.")


def _outcomes(arguments: argparse.Namespace, found: CaptureFolder) -> Iterator[Outcome]:
    from fieldcam.analysis.messages import Setup
    from fieldcam.app.analysis import start_analysis
    from fieldcam.session.importing import ImportTerms, import_pairs
    from fieldcam.store.folder import DataKind, data_path
    from fieldcam.store.rows.orchard import Block
    from fieldcam.store.store import open_store

    path = data_path(arguments.data)
    with (
        open_store(path, DataKind.FIELD) as store,
        start_analysis(Setup(None, data=path), path) as analysis,
    ):
        _doubt_the_days(store.database, arguments.block, found)
        accepting = (Status.ACCEPT, Status.CONFIRM)[: 2 if arguments.accept_confirm else 1]
        terms = ImportTerms(found.checksums, accepting, arguments.tag_size_mm)
        yield from import_pairs(store, Block(arguments.block), analysis, found.captures, terms)


def _doubt_the_days(database: Database, name: str, found: CaptureFolder) -> None:
    """Those of the folder together with those that the block has."""
    from fieldcam.growth.warnings.dates import doubtful_dates
    from fieldcam.store.queries.blocks import block_named, visits

    block = block_named(database, name)
    known = () if block is None else visits(database, block.id)
    days = {*(visit.day for visit in known), *(capture.day for capture in found.captures)}
    for _, text in doubtful_dates(sorted(days), date.today()):
        narrate(text)


def _problems(found: CaptureFolder, outcomes: Sequence[Outcome]) -> tuple[FolderProblem, ...]:
    """Those of the folder and those of its pairs."""
    from fieldcam.exchange.capture_folder import FolderProblem

    of_pairs = (FolderProblem(each.file.left, each.problem) for each in outcomes if each.problem)
    return tuple(sorted([*found.problems, *of_pairs]))


def _of_verdict(status: Status, outcomes: Sequence[Outcome]) -> list[FolderProblem]:
    """Pairs that are stored, but whose pictures say too little, or ask something."""
    from fieldcam.exchange.capture_folder import FolderProblem

    verdicts = ((each.file.left, each.verdict) for each in outcomes if each.verdict is not None)
    return [
        FolderProblem(path, " ".join(reason.text for reason in verdict.reasons))
        for path, verdict in verdicts
        if verdict.status is status
    ]


def _entries(problems: Sequence[FolderProblem]) -> list[dict[str, str]]:
    return [{"path": str(problem.path), "text": problem.text} for problem in problems]


def _counts(found: CaptureFolder, outcomes: Sequence[Outcome], questions: int) -> dict[str, int]:
    fates = Counter(str(each.fate) for each in outcomes)
    read = [each.status for each in outcomes if each.status is not None]
    retakes = read.count(Status.RETAKE)
    return {
        "pairs": len(outcomes),
        **{fate: fates[fate] for fate in ("added", "known", "skipped")},
        "unpaired": sum(problem.unpaired for problem in found.problems),
        "analysed": len(read),
        "accepted": len(read) - retakes - questions,
        "retakes": retakes,
        "unread": sum(each.unread for each in outcomes),
        "mended": sum(each.mended for each in outcomes),
    }


def _lines(arguments: argparse.Namespace, counts: dict[str, int]) -> Iterator[str]:
    yield (
        f"Block {arguments.block}: {number_of(counts['pairs'], 'pair')}; {counts['added']} added,"
        f" {counts['known']} there before, {counts['skipped']} skipped."
    )
    yield (
        f"Analysed: {counts['analysed']}; {counts['accepted']} accepted,"
        f" {counts['analysed'] - counts['accepted'] - counts['retakes']} to be decided on,"
        f" {counts['retakes']} would have to be taken again."
    )
    if counts["unread"]:
        yield (
            f"Stored and not read, though tried twice: {number_of(counts['unread'], 'pair')}."
            " Import the folder again when the machine has time for them."
        )
    if counts["mended"]:
        images = number_of(counts["mended"], "image")
        yield f"Mended: {images} whose copy in the data folder was damaged."
    if counts["unpaired"]:
        yield f"Left out: {number_of(counts['unpaired'], 'image')} without the other eye's."


def _listed(
    heading: str, arguments: argparse.Namespace, problems: Sequence[FolderProblem]
) -> Iterator[str]:
    if problems:
        yield f"\n{heading}:"
        yield from (f"  {_shown(arguments.folder, problem)}" for problem in problems)


def _shown(folder: Path, problem: FolderProblem) -> str:
    """The sentence after the place, each named from the folder on."""
    place, text = problem.path.relative_to(folder), problem.text.replace(f"{folder}/", "")
    return text if str(place) in text else f"{place}: {text}"
