"""`fieldcam camera features`: what a camera can be set to, and how it is set now."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json
from fieldcam.cli.cameras.chosen import add_serial, choose_camera
from fieldcam.cli.console import emit, emit_json, narrate, printable, screen_width, table
from fieldcam.errors import CameraUnsupported, FeatureFileInvalid

if TYPE_CHECKING:
    from fieldcam.camera.genapi import Entry, FeatureFile

ASK_THE_CAMERA = "(ask the camera)"
"""Printed where only registers know."""
INDENT = "  "
MIN_ROOM = 20
"""Characters for values, however narrow the terminal is."""
INTEGER_RANGE = [-(2**63), 2**63 - 1]
LARGEST_SINGLE = 3.4e38
"""Ranges that reach so far say nothing but the type."""


def register(actions: Subparsers[Parser]) -> None:
    features = add_command(actions, "features", "list a camera's features", _features)
    source = features.add_mutually_exclusive_group()
    source.add_argument(
        "--xml",
        type=Path,
        metavar="FILE",
        help="a GenICam feature file, plain or zipped; needs no camera",
    )
    add_serial(source)
    add_json(features)


def _features(arguments: argparse.Namespace) -> None:
    if arguments.xml is None:
        document, entries = _of_camera(arguments.serial)
    else:
        document, entries = _of_file(arguments.xml)
    if arguments.json:
        emit_json(
            {
                "vendor": document.vendor,
                "model": document.model,
                "schema_version": document.schema_version,
                "features": entries,
            }
        )
        return
    for line in feature_lines(entries, ASK_THE_CAMERA if arguments.xml else "", screen_width()):
        emit(line)
    narrate(
        f"{printable(f'{document.vendor} {document.model}')}, GenApi {document.schema_version}: "
        f"{len(entries)} features in the category tree, {len(document.nodes)} nodes in all."
    )
    if arguments.xml is not None:
        narrate("? behind an access: it depends on the camera's present settings.")


def _of_file(path: Path) -> tuple[FeatureFile, list[Entry]]:
    from fieldcam.camera.genapi import NoCamera, NodeMap, declared_entries, load_feature_file
    from fieldcam.foreign.bounds import FEATURES
    from fieldcam.foreign.files import read_foreign

    document = load_feature_file(read_foreign(path, FEATURES))
    return document, list(declared_entries(NodeMap(document, NoCamera())))


def _of_camera(serial: str | None) -> tuple[FeatureFile, list[Entry]]:
    """What is wrong with the file that a camera brings is the camera's fault."""
    from fieldcam.camera.genapi import NodeMap, present_entries
    from fieldcam.camera.usb3vision.description import cache_folder
    from fieldcam.camera.usb3vision.devices import open_attached

    with open_attached(choose_camera(serial)) as camera:
        try:
            document = camera.description(cache_folder()).document
            return document, list(present_entries(NodeMap(document, camera.registers)))
        except FeatureFileInvalid as error:
            raise CameraUnsupported(error.message, error.hint) from error


def feature_lines(
    entries: Iterable[Entry], unknown: str = "", width: int | None = None
) -> list[str]:
    """A table for reading; `unknown` stands for a value that nobody told.

    What is behind the last column's begin is folded to `width` characters a line.
    """
    rows = [["feature", "type", "access", "values"]]
    rows += [[printable(cell) for cell in _row(entry, unknown)] for entry in entries]
    begin = sum(max(len(row[i]) for row in rows) + 2 for i in range(3))
    room = None if width is None else max(width - begin, MIN_ROOM)
    return table([line for row in rows for line in _folded(row, room)], "<<<<")


def _folded(row: list[str], room: int | None) -> Iterator[list[str]]:
    *cells, values = row
    for piece in [values] if room is None else wrap(values, room) or [""]:
        yield [*cells, piece]
        cells = [""] * len(cells)


def _row(entry: Entry, unknown: str) -> list[str]:
    conditional = "?" if entry.get("conditional") else ""
    return [
        INDENT * entry["depth"] + entry["name"],
        entry["type"],
        "" if entry["type"] == "category" else f"{entry['access'] or '-'}{conditional}",
        " ".join(_words(entry, unknown)),
    ]


def _words(entry: Entry, unknown: str) -> Iterator[str]:
    if "problem" in entry:
        yield entry["problem"]
    if "entries" in entry:
        yield ", ".join(e["name"] for e in entry["entries"] if e["available"] is not False)
    unit = f" {entry['unit']}" if entry.get("unit") else ""
    if entry.get("value") is not None:
        yield f"= {_number(entry['value'], unknown)}{unit}"
        if _bounded(entry) and entry["access"] == "RW":
            yield f"({_range(entry, unknown)})"
    elif "min" in entry:
        yield f"{_range(entry, unknown)}{unit}" if _bounded(entry) else unknown
    elif "value" in entry and "entries" not in entry:
        yield unknown


def _bounded(entry: Entry) -> bool:
    if "min" not in entry:
        return False
    ends = [entry["min"], entry["max"]]
    if entry["type"] == "integer":
        return ends not in ([None, None], INTEGER_RANGE)
    return any(end is not None and abs(end) < LARGEST_SINGLE for end in ends)


def _range(entry: Entry, unknown: str) -> str:
    step = entry["increment"]
    steps = f" in steps of {_number(step, unknown)}" if step not in (None, 1) else ""
    return f"{_number(entry['min'], unknown)} to {_number(entry['max'], unknown)}{steps}"


def _number(value: object, unknown: str) -> str:
    if value is None:
        return unknown
    return f"{value:.10g}" if isinstance(value, float) else str(value)
