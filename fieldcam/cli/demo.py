"""`fieldcam demo`: a walk along a simulated row.

At a terminal it is the app; else the walk is made without a screen, and the sizes
are printed beside the truth.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json, count, positive_count
from fieldcam.cli.console import at_a_terminal, emit, emit_json, narrate, table
from fieldcam.cli.launcher import launch
from fieldcam.cli.networks import checked_models
from fieldcam.errors import BadInput
from fieldcam.values import Status

if TYPE_CHECKING:
    from fieldcam.report.scoring import Scored, ScoredCapture
    from fieldcam.simulator import BlockPlan

SIMULATED = "Simulated orchard: every picture here is rendered, none is of a real fruit."


@dataclass(frozen=True, slots=True)
class _Stop:
    """One capture of the walk."""

    tag_id: int
    day: int
    scored: ScoredCapture
    duration_ms: float
    """From saved to reading."""


def register(commands: Subparsers[Parser]) -> None:
    demo = add_command(commands, "demo", "walk a simulated row, sizes beside the truth", _demo)
    demo.add_argument("--headless", action="store_true", help="without a screen")
    demo.add_argument("--clusters", type=positive_count, default=4, metavar="N", help="of the row")
    demo.add_argument("--days", type=_days, default=(0, 2, 4), metavar="0,2,4", help="when")
    demo.add_argument("--seed", type=count, default=1, metavar="N", help="which orchard")
    demo.add_argument(
        "--replay", type=Path, metavar="DIR", help="walk a folder of captures in the app instead"
    )
    demo.epilog = (
        "Its pictures lie in a data folder of their own: DIR of --data, else the one of"
        " FIELDCAM_DATA with -demo behind its name, else the user's own fieldcam-demo."
    )
    add_json(demo)


def _demo(arguments: argparse.Namespace) -> None:
    if arguments.replay is not None:
        _replay(arguments)
        return
    if not (arguments.headless or arguments.json) and at_a_terminal():
        from fieldcam.app.simulated import walk_simulated_row

        checked_models(arguments.data)
        chosen = (arguments.data, arguments.seed, arguments.clusters, arguments.days)
        launch(partial(walk_simulated_row, *chosen))
        return
    from fieldcam.camera.simulated import plan_block
    from fieldcam.report.scoring import summary

    models = checked_models(arguments.data)
    block = plan_block(arguments.seed, arguments.clusters)
    narrate(SIMULATED)
    stops = []
    for stop in _walk(arguments, block):
        stops.append(stop)
        if not arguments.json:
            emit("\n".join(_stop_lines(stop)) + "\n")
    asking = [stop for stop in stops if stop.scored.reading.verdict.status is Status.CONFIRM]
    figures = {
        "stored": len(block.clusters) * len(arguments.days),
        "undecided": len(asking),
        **summary(stop.scored for stop in stops),
    }
    if arguments.json:
        entries = [_stop_entry(stop) for stop in stops]
        note = {"simulated": True, "note": models.honesty}
        emit_json({**note, "captures": entries, "summary": figures})
    else:
        emit("\n".join([*_summary_lines(figures), "", SIMULATED, models.honesty]))


def _replay(arguments: argparse.Namespace) -> None:
    from fieldcam.app.replayed import walk_recorded_folder
    from fieldcam.exchange.capture_folder import read_capture_folder

    read_capture_folder(arguments.replay)
    if arguments.headless or arguments.json or not at_a_terminal():
        raise BadInput("--replay needs a terminal.", "`fieldcam import` reads a folder without.")
    checked_models(arguments.data)
    launch(partial(walk_recorded_folder, arguments.data, arguments.replay))


def _walk(arguments: argparse.Namespace, block: BlockPlan) -> Iterator[_Stop]:
    """All captures that could be read, as they come."""
    from fieldcam.app.headless import walk_row
    from fieldcam.report.scoring import score_capture
    from fieldcam.store.folder import DataKind, data_path
    from fieldcam.store.store import open_store

    path, networks = data_path(arguments.data, DataKind.SIMULATED), data_path(arguments.data)
    with open_store(path, DataKind.SIMULATED) as store:
        for read in walk_row(store, block, arguments.days, networks, narrate):
            truth = read.picture.truth
            scored = score_capture(read.reading, truth)
            yield _Stop(truth.tag_id, read.picture.day, scored, read.duration_ms)


def _stop_lines(stop: _Stop) -> list[str]:
    verdict = stop.scored.reading.verdict
    lines = [
        f"Tag {stop.tag_id}, day {stop.day}: {verdict.status.upper()}"
        f"  ({stop.duration_ms / 1000:.2f} s)"
    ]
    lines += [f"  {reason.text}" for reason in verdict.reasons]
    rows = [["fruitlet", "size mm", "true mm", "error mm", "visible", ""]]
    rows += [_row(scored) for scored in stop.scored.fruitlets]
    return [*lines, *(f"  {line}" for line in table(rows, ">>>>><"))]


def _row(scored: Scored) -> list[str]:
    reading, truth, error = scored.reading, scored.truth, scored.error_mm
    foreign = truth is None or not truth.in_target
    size = None if reading is None else reading.diameter_mm
    return [
        "-" if truth is None or foreign else str(truth.id),
        "-" if size is None else f"{size:.2f}",
        "-" if truth is None else f"{truth.diameter_mm:.2f}",
        "-" if error is None else f"{error:+.2f}",
        "-" if truth is None else f"{truth.visible_fraction:.0%}",
        "not of this cluster" if foreign else _note(scored),
    ]


def _note(scored: Scored) -> str:
    if scored.reading is None:
        return "not found"
    return ", ".join(str(flag).replace("_", " ") for flag in scored.reading.flags)


def _stop_entry(stop: _Stop) -> dict[str, Any]:
    verdict = stop.scored.reading.verdict
    return {
        "tag": stop.tag_id,
        "day": stop.day,
        "status": verdict.status,
        "reasons": [reason.code for reason in verdict.reasons],
        "analysis_ms": round(stop.duration_ms, 1),
        "fruitlets": [_fruitlet_entry(scored) for scored in stop.scored.fruitlets],
    }


def _fruitlet_entry(scored: Scored) -> dict[str, Any]:
    reading, truth = scored.reading, scored.truth
    return {
        "in_target": truth is not None and truth.in_target,
        "found": reading is not None,
        "diameter_mm": None if reading is None else reading.diameter_mm,
        "flags": [] if reading is None else list(reading.flags),
        "true_id": None if truth is None else truth.id,
        "true_diameter_mm": None if truth is None else truth.diameter_mm,
        "true_visible_fraction": None if truth is None else truth.visible_fraction,
    }


def _summary_lines(figures: Mapping[str, Any]) -> list[str]:
    def share(name: str) -> str:
        return "-" if figures[name] is None else f"{figures[name]:.1%}"

    def millimetres(name: str, form: str = ".2f") -> str:
        return "-" if figures[name] is None else f"{figures[name]:{form}} mm"

    return [
        f"captures {figures['stored']} stored, {figures['captures']} read,"
        f" sizes {figures['sizes']}, retakes {figures['retakes']},"
        f" to decide {figures['undecided']}",
        f"error: mean {millimetres('mae_mm')}, bias {millimetres('bias_mm', '+.2f')},"
        f" 95 % within {millimetres('p95_mm')}",
        f"sized: {share('sized_share_well_visible')} of the fruitlets at least 60 % visible,"
        f" {share('sized_share_all')} of all in view",
        f"readings that are no fruitlet of the cluster: {share('foreign_share')}",
    ]


def _days(text: str) -> tuple[int, ...]:
    """An argparse type for a list of days; each is walked once."""
    days = tuple(count(day.strip()) for day in text.split(","))
    if list(days) != sorted(set(days)):
        raise argparse.ArgumentTypeError(f"{text!r}: days must rise")
    return days
