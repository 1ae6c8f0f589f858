"""A block as a table for spreadsheets: a row for each fruitlet, a column for each visit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import date
from functools import partial
from math import floor

from fieldcam.exchange.calipers.columns import CERTAINTY, DIAM, DOUBT, MEASURED_BY, STATE
from fieldcam.exchange.calipers.record import record_of_sizes
from fieldcam.exchange.tables.written import csv_text
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, SizeSource
from fieldcam.growth.warnings.doubts import doubts_told, is_doubtful

Cell = Callable[[FruitletRecord], str]


def wide_table(record: BlockRecord) -> str:
    """The block as CSV `tree,cluster,fruit,diam.<date>...`, one row for each fruitlet.

    Where empty cells would not say enough, as for a fruitlet that a camera could not see,
    columns `state.<date>` follow, and where a camera measured, `measured_by` says so. Where it is
    not sure enough that a fruitlet is the one of before, `sure.<date>` holds the certainty, and
    `doubt` says so, and of growth that no fruitlet has. Sizes are written to 0.01 mm.
    """
    columns = dict(_columns(record))
    rows = ([cell(each) for cell in columns.values()] for each in record.fruitlets)
    return csv_text([list(columns), *rows])


def _columns(record: BlockRecord) -> Iterator[tuple[str, Cell]]:
    yield "tree", lambda each: record.tree_of.get(each.tag_id, "")
    yield "cluster", lambda each: str(each.tag_id)
    yield "fruit", lambda each: each.fruitlet
    for day in record.visits:
        yield f"{DIAM}{day}", partial(_size, day)
    if _needs_states(record):
        for day in record.visits:
            yield f"{STATE}{day}", partial(_state, day)
    for day in record.visits:
        if any(_certainty(day, each) for each in record.fruitlets):
            yield f"{CERTAINTY}{day}", partial(_certainty, day)
    if record.source is SizeSource.CAMERA:
        yield MEASURED_BY, lambda each: record.source
    if any(_doubts(record, each) for each in record.fruitlets):
        yield DOUBT, partial(_doubts, record)


def _size(day: date, fruitlet: FruitletRecord) -> str:
    seen = fruitlet.sightings.get(day)
    return "" if seen is None or seen.diameter_mm is None else f"{seen.diameter_mm:.2f}"


def _state(day: date, fruitlet: FruitletRecord) -> str:
    seen = fruitlet.sightings.get(day)
    return "" if seen is None else str(seen.presence)


def _certainty(day: date, fruitlet: FruitletRecord) -> str:
    """Where it is doubtful; rounded down, so that it stays so."""
    seen = fruitlet.sightings.get(day)
    if seen is None or not is_doubtful(seen):
        return ""
    return f"{floor(100 * seen.confidence) / 100:.2f}"


def _doubts(record: BlockRecord, fruitlet: FruitletRecord) -> str:
    return ", ".join(doubts_told(fruitlet, record.visits, record.source))


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
