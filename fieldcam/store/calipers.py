"""What calipers measured, and which fruitlets of the pictures they measured."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import date
from typing import Any

from sqlite_utils import Database

from fieldcam.store.connection import rows
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.fruit import CaliperSize


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
    sql = (
        "SELECT id, tag_id, day, fruit, diameter_mm, source FROM caliper_size_now"
        " WHERE block = ? ORDER BY tag_id, day, fruit"
    )
    return tuple(
        MeasuredFruit(**{**row, "day": date.fromisoformat(row["day"])})
        for row in rows(database, sql, block)
    )


def typed_sizes(database: Database, visit: EntryId, day: date) -> dict[EntryId, CaliperSize]:
    """What was typed at the pictures of a visit while this was its day, by its row."""
    found = rows(
        database,
        "SELECT size.id, size.block, size.tag_id, size.fruit, size.diameter_mm"
        " FROM caliper_size_now AS size JOIN visit ON visit.block = size.block"
        " WHERE visit.id = ? AND size.day = ? AND size.source IS NULL"
        " AND size.tag_id IN (SELECT tag_id FROM capture_now WHERE visit = visit.id)",
        visit,
        day.isoformat(),
    )
    return {row.pop("id"): CaliperSize(day=day, **row) for row in found}


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
    """Matched by name alone; of several pictures of a day the larger size counts."""
    camera: dict[tuple[int, date, str], float] = {}
    for seen in named:
        if seen.diameter_mm is not None:
            key = seen.tag_id, seen.day, seen.fruit
            camera[key] = max(seen.diameter_mm, camera.get(key, 0.0))
    return tuple(
        MeasuredTwice(size.tag_id, size.day, size.fruit, size.diameter_mm, camera[key])
        for size in sizes
        if (key := (size.tag_id, size.day, size.fruit)) in camera
    )


def _named(row: dict[str, Any]) -> NamedFruitlet:
    sizes = {size["id"]: size["diameter_mm"] for size in json.loads(row.pop("sizes"))}
    return NamedFruitlet(
        **{**row, "day": date.fromisoformat(row["day"])},
        diameter_mm=sizes.get(row["fruitlet"]),
    )
