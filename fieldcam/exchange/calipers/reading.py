"""Caliper tables, read in every shape that is in use.

What had to be assumed to read a table is told in notes, a sentence each; what has more
than one meaning is refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.exchange.calipers.columns import SHAPES, caliper_table
from fieldcam.exchange.calipers.record import record_of
from fieldcam.exchange.calipers.shapes import CaliperCell, cells_of, has_dates
from fieldcam.exchange.calipers.sizes import (
    FruitOnDay,
    check_sizes,
    in_one_numbering,
    named_by_size,
    sizes_of,
    source_of,
)
from fieldcam.exchange.tables.dates import calendar_of
from fieldcam.exchange.tables.files import read_sheets
from fieldcam.exchange.tables.sheets import Sheet
from fieldcam.growth.records import BlockRecord, Presence, SizeSource
from fieldcam.words import number_of, spelled_out


@dataclass(frozen=True, slots=True)
class CaliperTable:
    """A block as somebody measured it with calipers."""

    record: BlockRecord
    notes: tuple[str, ...]
    """What was assumed when it was read."""
    named: bool
    """Fruits have names of their own; else they are called by their size order."""


def read_calipers(path: Path, dates: Sequence[date] = ()) -> CaliperTable:
    """The sizes of a CSV table, a workbook or a spreadsheet; the block gets the file's name.

    `dates` are those of visits that the table only numbers. Raises BadInput with the line, or the
    sheet and cell, that cannot be read.
    """
    name = spelled_out(path.name)
    cells, sheet_notes = _cells(name, read_sheets(path), dates)
    calendar = calendar_of(cell.day for cell in cells)
    sizes, tree_note = sizes_of(cells, calendar)
    check_sizes(name, sizes)
    numbered, renumbering = in_one_numbering(name, sizes)
    record, assumed = record_of(spelled_out(path.stem), named_by_size(numbered))
    record = replace(record, source=source_of(name, numbered))
    notes = (
        *sheet_notes,
        *calendar.notes,
        tree_note,
        renumbering,
        *_notes(name, numbered),
        *assumed,
    )
    return CaliperTable(
        record,
        tuple(note for note in notes if note),
        named=all(each.fruit for each in numbered),
    )


def _cells(
    name: str, sheets: Sequence[Sheet], dates: Sequence[date]
) -> tuple[list[CaliperCell], list[str]]:
    """Of all sheets that hold a caliper table."""
    filled = [sheet for sheet in sheets if sheet.rows]
    if not filled:
        raise BadInput(f"{name} is empty.")
    tables = [(sheet, caliper_table(sheet)) for sheet in filled]
    found = [table for _, table in tables if table is not None]
    if not found:
        top = " ".join(filter(None, filled[0].rows[0].cells))[:60]
        raise BadInput(f"{name} has no heading of a caliper table; it begins with {top!r}.", SHAPES)
    others = [sheet.title or "" for sheet, table in tables if table is None]
    dated = [table for table in found if has_dates(table)] or found
    undated = [table.sheet.title or "" for table in found if table not in dated]
    read = [cells_of(table, dates) for table in dated]
    return [cell for each in read for cell in each.cells], [
        *_left_out("that hold no caliper table", others),
        *_left_out("that are named as no date, and have no column of dates,", undated),
        *_left_out("without rows", [t.sheet.title or "" for t in found if not t.rows]),
        *dict.fromkeys(note for each in read for note in each.notes),
    ]


def _left_out(which: str, sheets: Sequence[str]) -> Iterator[str]:
    if sheets:
        yield f"Sheets {which} were left out: {', '.join(sheets)}."


def _notes(name: str, sizes: Sequence[FruitOnDay]) -> Iterator[str]:
    if comma := next((each for each in sizes if "," in each.written), None):
        yield (
            f"{name} has commas as decimals: {comma.written} was read as {comma.diameter_mm} mm."
        )
    if any(each.source is SizeSource.CAMERA for each in sizes):
        yield f"{name} holds sizes by camera: they are taken with the camera's errors."
    if any(not each.fruit for each in sizes):
        yield (
            "Fruits have no names: within each cluster they were paired by size order, the"
            " largest with the largest. Who overtook whom is lost."
        )
    sized = {each.day for each in sizes if each.diameter_mm is not None}
    if unused := sorted({each.day for each in sizes} - sized):
        yield (
            f"Without any size, and so no visit: {', '.join(map(str, unused))}. The forecast is"
            " made from the other days."
        )
    yield from _about_nothing(name, [each for each in sizes if each.nothing])
    named = {(each.cluster, each.fruit) for each in sizes}
    measured = {(each.cluster, each.fruit) for each in sizes if each.diameter_mm is not None}
    if never := len(named - measured):
        yield f"Left out: {number_of(never, 'fruit')} without any size."
    days = list(dict.fromkeys(each.day for each in sizes if each.cluster == sizes[0].cluster))
    if days != sorted(days):
        yield f"The dates of {name} are not in order; they were sorted."


def _about_nothing(name: str, cells: Sequence[FruitOnDay]) -> Iterator[str]:
    if not cells:
        return
    counted = f"{name} says {cells[0].written} or the like in {number_of(len(cells), 'cell')}"
    if cells[0].presence is Presence.NOT_SEEN:
        yield f"{counted}, beside empty ones: read as not measured."
    else:
        yield f"{counted}, and leaves none empty: read as empty cells."
