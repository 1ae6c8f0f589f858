"""Caliper tables: read in every shape that is in use, written in the one of spreadsheets.

What had to be assumed to read a table is told in notes, a sentence each; what has more
than one meaning is refused.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.exchange.caliper_cells import is_word_for_nothing
from fieldcam.exchange.caliper_record import record_of, record_of_sizes
from fieldcam.exchange.caliper_shapes import DIAM, MEASURED_BY, STATE, long_or_wide, of_authors
from fieldcam.exchange.caliper_sizes import (
    CaliperSize,
    check_sizes,
    in_one_numbering,
    named_by_size,
    source_of,
)
from fieldcam.exchange.caliper_tables import WORKBOOKS, csv_table, workbook_tables
from fieldcam.growth.records import BlockRecord, Presence, Source
from fieldcam.words import number_of


@dataclass(frozen=True, slots=True)
class CaliperTable:
    """A block as somebody measured it with calipers."""

    record: BlockRecord
    notes: tuple[str, ...]
    """What was assumed when it was read."""
    named: bool
    """Fruits have names of their own; else they are called by their size order."""


def read_calipers(path: Path, dates: Sequence[date] = ()) -> CaliperTable:
    """The sizes of a CSV table or a workbook; the block gets the file's name.

    `dates` are those of visits that the table only numbers. Raises BadInput with the line,
    or the sheet and cell, that cannot be read.
    """
    if path.suffix.lower() in WORKBOOKS:
        sizes, left_out = _of_workbook(path, dates)
    else:
        sizes, left_out = list(long_or_wide(csv_table(path), dates)), []
    check_sizes(path.name, sizes)
    numbered, renumbering = in_one_numbering(path.name, sizes)
    record, assumed = record_of(path.stem, named_by_size(numbered))
    record = replace(record, source=source_of(path.name, numbered))
    notes = (*left_out, renumbering, *_notes(path.name, numbered), *assumed)
    named = all(each.fruit for each in numbered)
    return CaliperTable(record, tuple(note for note in notes if note), named)


def wide_table(record: BlockRecord) -> str:
    """The block as CSV `tree,cluster,fruit,diam.<date>...`, one row for each fruitlet.

    Where empty cells would not say enough, as for a fruitlet that a camera could not see,
    columns `state.<date>` follow, and where a camera measured, `measured_by` says so. Sizes
    are written to 0.01 mm, and confidences are left out.
    """
    days = record.visits
    states = days if _needs_states(record) else ()
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    columns = [f"{DIAM}{day}" for day in days] + [f"{STATE}{day}" for day in states]
    measured_by = {MEASURED_BY: record.source} if record.source is Source.CAMERA else {}
    writer.writerow(["tree", "cluster", "fruit", *columns, *measured_by])
    for each in record.fruitlets:
        seen = each.sightings
        sizes = ["" if day not in seen else _written(seen[day].diameter_mm) for day in days]
        said = [str(seen[day].presence) if day in seen else "" for day in states]
        tree = record.tree_of.get(each.tag_id, "")
        writer.writerow([tree, each.tag_id, each.fruitlet, *sizes, *said, *measured_by.values()])
    return out.getvalue()


def _of_workbook(path: Path, dates: Sequence[date]) -> tuple[list[CaliperSize], list[str]]:
    if dates:
        raise BadInput(f"{path.name} names its own dates.", "Leave out --dates.")
    tables, others = workbook_tables(path)
    if not tables:
        raise BadInput(f"No sheet of {path.name} is named as a date, such as 2026-05-21.")
    sizes = [size for table in tables for size in of_authors(table)]
    return sizes, [
        *_left_out("that are not named as a date", others),
        *_left_out("without rows", [table.sheet for table in tables if not table.rows]),
    ]


def _left_out(which: str, sheets: Sequence[str]) -> Iterator[str]:
    if sheets:
        yield f"Sheets {which} were left out: {', '.join(sheets)}."


def _notes(name: str, sizes: Sequence[CaliperSize]) -> Iterator[str]:
    if any("," in each.written for each in sizes):
        yield f"{name} has commas as decimals; 9,1 was read as 9.1 mm."
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
    if words := sum(is_word_for_nothing(each.written) for each in sizes):
        yield (
            f"{name} says NA or the like in {number_of(words, 'cell')}: read as an empty cell, and"
            " so as fallen where no later size follows."
        )
    named = {(each.cluster, each.fruit) for each in sizes}
    measured = {(each.cluster, each.fruit) for each in sizes if each.diameter_mm is not None}
    if never := len(named - measured):
        yield f"Left out: {number_of(never, 'fruit')} without any size."
    days = list(dict.fromkeys(each.day for each in sizes if each.cluster == sizes[0].cluster))
    if days != sorted(days):
        yield f"The dates of {name} are not in order; they were sorted."


def _needs_states(record: BlockRecord) -> bool:
    sizes = {
        (each.tag_id, each.fruitlet): {
            day: seen.diameter_mm
            for day, seen in each.sightings.items()
            if seen.diameter_mm is not None
        }
        for each in record.fruitlets
    }
    assumed, _ = record_of_sizes(record.name, sizes, record.tree_of)
    return _presences(assumed) != _presences(record)


def _presences(record: BlockRecord) -> dict[tuple[int, str], dict[date, Presence]]:
    return {
        (each.tag_id, each.fruitlet): {day: seen.presence for day, seen in each.sightings.items()}
        for each in record.fruitlets
    }


def _written(diameter_mm: float | None) -> str:
    return "" if diameter_mm is None else f"{diameter_mm:.2f}"
