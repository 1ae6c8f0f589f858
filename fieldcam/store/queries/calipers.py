"""What calipers measured, and which fruitlets of the pictures they measured."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import date
from typing import Any

from sqlite_utils import Database

from fieldcam.growth.size_rule import SizeRule
from fieldcam.store.connection import rows, rows_as
from fieldcam.store.rows.fruit import CaliperSize
from fieldcam.store.rows.row import EntryId, from_columns


@dataclass(frozen=True, slots=True)
class MeasuredFruit:
    """A fruit by caliper."""

    id: EntryId
    tag_id: int
    day: date
    fruit: str
    diameter_mm: float
    source: str | None


@dataclass(frozen=True, slots=True)
class NamedFruitlet:
    """A fruitlet of a picture's last reading that has a name."""

    tag_id: int
    day: date
    capture: EntryId
    reading: EntryId
    fruitlet: int
    fruit: str
    diameter_mm: float | None
    """By camera; None where it was seen and not sized."""
    sd_mm: float | None = None
    """Standard deviation of the diameter; None where it is unknown."""


@dataclass(frozen=True, slots=True)
class MeasuredTwice:
    """One fruit on one day, by caliper and by camera."""

    tag_id: int
    day: date
    fruit: str
    calipers_mm: float
    camera_mm: float


def caliper_sizes(database: Database, block: EntryId) -> tuple[MeasuredFruit, ...]:
    """The last word on each fruit and day, by cluster and day."""
    sql = "SELECT * FROM caliper_size_now WHERE block = ? ORDER BY tag_id, day, fruit"
    return rows_as(database, MeasuredFruit, sql, block)


def typed_sizes(database: Database, visit: EntryId, day: date) -> dict[EntryId, CaliperSize]:
    """What was typed at the pictures of a visit while this was its day, by its row."""
    found = rows(
        database,
        "SELECT size.* FROM caliper_size_now AS size JOIN visit ON visit.block = size.block"
        " WHERE visit.id = ? AND size.day = ? AND size.source IS NULL"
        " AND size.tag_id IN (SELECT tag_id FROM capture_now WHERE visit = visit.id)",
        visit,
        day.isoformat(),
    )
    return {row["id"]: from_columns(CaliperSize, row) for row in found}


def named_fruitlets(database: Database, block: EntryId) -> tuple[NamedFruitlet, ...]:
    """Those of pictures that are not to be taken again, by cluster and day.

    A fruitlet that was struck out since has no name any more.
    """
    found = rows(
        database,
        "SELECT capture.tag_id, visit.day, capture.id AS capture, reading.id AS reading,"
        " said.fruitlet, said.fruit, reading.sizes FROM caliper_identity_now AS said"
        " JOIN reading ON reading.id = said.reading"
        " JOIN capture_now AS capture ON capture.id = reading.capture"
        " AND capture.reading = reading.id"
        " JOIN visit_now AS visit ON visit.id = capture.visit"
        " WHERE visit.block = ? AND capture.tag_id IS NOT NULL"
        " AND coalesce(capture.action, 'accept') = 'accept'"
        " AND NOT EXISTS (SELECT 1 FROM fruitlet_mark_now AS mark"
        " WHERE mark.reading = reading.id AND mark.fruitlet = said.fruitlet"
        " AND mark.mark = 'not_a_fruitlet')"
        " ORDER BY capture.tag_id, visit.day, capture.turn, said.fruit",
        block,
    )
    return tuple(_named(row) for row in found)


def names_in(database: Database, reading: EntryId) -> dict[int, str]:
    """Names of one reading's fruitlets, by their ids."""
    sql = "SELECT fruitlet, fruit FROM caliper_identity_now WHERE reading = ?"
    return {row["fruitlet"]: row["fruit"] for row in rows(database, sql, reading)}


def measured_twice(
    sizes: Iterable[MeasuredFruit], named: Iterable[NamedFruitlet]
) -> tuple[MeasuredTwice, ...]:
    """Matched by name alone; of several pictures of a day the better-known size counts."""
    camera: dict[tuple[int, date, str], list[NamedFruitlet]] = {}
    for seen in named:
        camera.setdefault((seen.tag_id, seen.day, seen.fruit), []).append(seen)
    found = []
    for size in sizes:
        views = camera.get((size.tag_id, size.day, size.fruit), [])
        counts = SizeRule.BETTER_KNOWN.chosen(views)
        if counts is not None and counts.diameter_mm is not None:
            both = size.diameter_mm, counts.diameter_mm
            found.append(MeasuredTwice(size.tag_id, size.day, size.fruit, *both))
    return tuple(found)


def _named(row: dict[str, Any]) -> NamedFruitlet:
    sizes = {size["id"]: size for size in json.loads(row["sizes"])}
    size = sizes.get(row["fruitlet"], {})
    known = {"diameter_mm": size.get("diameter_mm"), "sd_mm": size.get("sd_mm")}
    return from_columns(NamedFruitlet, {**row, **known})
