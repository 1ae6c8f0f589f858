"""`fieldcam recover`: a data folder in order again, after damage or loss."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json
from fieldcam.cli.console import emit, emit_json
from fieldcam.cli.progress import progress
from fieldcam.words import number_of

if TYPE_CHECKING:
    from fieldcam.session.catching_up import CaughtUp
    from fieldcam.store.recovery.mending import Recovered


def register(commands: Subparsers[Parser]) -> None:
    add_json(
        add_command(
            commands,
            "recover",
            "mend the data folder: database, rows of pictures, damaged readings",
            _recover,
        )
    )


def _recover(arguments: argparse.Namespace) -> None:
    from fieldcam.store.folder import data_path
    from fieldcam.store.recovery.mending import recover

    path = data_path(arguments.data)
    found = recover(path)
    read = _read(path)
    if arguments.json:
        emit_json(_document(found, read))
    else:
        emit("\n".join(_lines(found, read)))


def _read(path: Path) -> tuple[CaughtUp, ...]:
    """Every picture that waits, with the networks that are installed."""
    from fieldcam.analysis.messages import Setup
    from fieldcam.app.analysis import start_analysis
    from fieldcam.session.catching_up import catch_up, simulated_camera
    from fieldcam.store.folder import known_data_folder
    from fieldcam.store.queries.resuming import waiting_for_analysis
    from fieldcam.store.store import open_unchecked

    with open_unchecked(path, known_data_folder(path).kind) as store:
        waiting = len(waiting_for_analysis(store.database))
        if not waiting:
            return ()
        setup = Setup(simulated_camera(store), data=path)
        with start_analysis(setup, path) as analysis:
            return tuple(progress(catch_up(store, analysis), waiting, "picture"))


def _lines(found: Recovered, read: tuple[CaughtUp, ...]) -> Iterator[str]:
    from fieldcam.store.recovery.words import recovery_lines

    yield from recovery_lines(found)
    done = [each for each in read if not each.problem]
    if done:
        yield f"Read: {number_of(len(done), 'picture')}."
    for problem in sorted({each.problem for each in read if each.problem}):
        which = sum(each.problem == problem for each in read)
        yield f"Not read: {number_of(which, 'picture')}. {problem}"


def _document(found: Recovered, read: tuple[CaughtUp, ...]) -> dict[str, object]:
    mended = found.mended
    return {
        "kept_as": found.kept_as,
        "rows_salvaged": None if mended is None else mended.salvaged,
        "rows_lost": None if mended is None else mended.lost,
        "pictures_rebuilt": found.pictures,
        "damaged_readings": [each.picture for each in found.report.damaged],
        "read": sum(not each.problem for each in read),
        "unread": sum(bool(each.problem) for each in read),
        "files": [
            {"name": each.name, "fault": each.fault, "belongs_to": each.belongs_to}
            for each in found.files
        ],
    }
