"""Caliper tables: read in every shape that is in use, written in the one of spreadsheets.

What had to be assumed to read a table is told in notes, a sentence each; what has more
than one meaning is refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date
from math import floor
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.exchange.caliper_columns import (
    CERTAINTY,
    DIAM,
    DOUBT,
    MEASURED_BY,
    SHAPES,
    STATE,
    caliper_table,
)
from fieldcam.exchange.caliper_record import record_of, record_of_sizes
from fieldcam.exchange.caliper_shapes import CaliperCell, cells_of, has_dates
from fieldcam.exchange.caliper_sizes import (
    CaliperSize,
    check_sizes,
    in_one_numbering,
    named_by_size,
    sizes_of,
    source_of,
)
from fieldcam.exchange.tables.dates import calendar_of
from fieldcam.exchange.tables.files import read_sheets
from fieldcam.exchange.tables.sheets import Sheet
from fieldcam.exchange.tables.written import csv_text
from fieldcam.growth.doubts import doubts_told, is_doubtful
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting, Source
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


def wide_table(record: BlockRecord) -> str:
    """The block as CSV `tree,cluster,fruit,diam.<date>...`, one row for each fruitlet.

    Where empty cells would not say enough, as for a fruitlet that a camera could not see,
    columns `state.<date>` follow, and where a camera measured, `measured_by` says so. Where it is
    not sure enough that a fruitlet is the one of before, `sure.<date>` holds the certainty, and
    `doubt` says so, and of growth that no fruitlet has. Sizes are written to 0.01 mm.
    """
    days = record.visits
    states = days if _needs_states(record) else ()
    unsure = [day for day in days if any(_is_unsure(each, day) for each in record.fruitlets)]
    doubts = [", ".join(doubts_told(each, days)) for each in record.fruitlets]
    columns = [f"{DIAM}{day}" for day in days] + [f"{STATE}{day}" for day in states]
    columns += [f"{CERTAINTY}{day}" for day in unsure]
    measured_by = {MEASURED_BY: record.source} if record.source is Source.CAMERA else {}
    doubt_column = [DOUBT] if any(doubts) else []
    rows: list[list[object]] = [
        ["tree", "cluster", "fruit", *columns, *measured_by, *doubt_column],
    ]
    for each, doubt in zip(record.fruitlets, doubts, strict=True):
        seen = each.sightings
        sizes = ["" if day not in seen else _written(seen[day].diameter_mm) for day in days]
        said = [str(seen[day].presence) if day in seen else "" for day in states]
        tree = record.tree_of.get(each.tag_id, "")
        sure = [_certainty(seen[day]) if _is_unsure(each, day) else "" for day in unsure]
        told = [*measured_by.values(), *([doubt] if doubt_column else [])]
        rows.append([tree, each.tag_id, each.fruitlet, *sizes, *said, *sure, *told])
    return csv_text(rows)


def _certainty(seen: Sighting) -> str:
    """Rounded down, so that a doubtful one stays doubtful."""
    return f"{floor(100 * seen.confidence) / 100:.2f}"


def _is_unsure(fruitlet: FruitletRecord, day: date) -> bool:
    return day in fruitlet.sightings and is_doubtful(fruitlet.sightings[day])


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


def _notes(name: str, sizes: Sequence[CaliperSize]) -> Iterator[str]:
    if comma := next((each for each in sizes if "," in each.written), None):
        yield (
            f"{name} has commas as decimals: {comma.written} was read as {comma.diameter_mm} mm."
        )
    if any(each.source is Source.CAMERA for each in sizes):
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


def _about_nothing(name: str, cells: Sequence[CaliperSize]) -> Iterator[str]:
    if not cells:
        return
    counted = f"{name} says {cells[0].written} or the like in {number_of(len(cells), 'cell')}"
    if cells[0].presence is Presence.NOT_SEEN:
        yield f"{counted}, beside empty ones: read as not measured."
    else:
        yield f"{counted}, and leaves none empty: read as empty cells."


def _needs_states(record: BlockRecord) -> bool:
    sizes = {
        (each.tag_id, each.fruitlet): {
            day: seen.diameter_mm
            for day, seen in each.sightings.items()
            if seen.diameter_mm is not None
        }
        for each in record.fruitlets
    }
    assumed = record_of_sizes(record.name, sizes, record.tree_of)
    return _presences(assumed) != _presences(record)


def _presences(record: BlockRecord) -> dict[tuple[int, str], dict[date, Presence]]:
    return {
        (each.tag_id, each.fruitlet): {day: seen.presence for day, seen in each.sightings.items()}
        for each in record.fruitlets
    }


def _written(diameter_mm: float | None) -> str:
    return "" if diameter_mm is None else f"{diameter_mm:.2f}"
