"""What is known about the blocks: their size, visits, settings and sprays."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

from sqlite_utils import Database

from fieldcam.store.connection import rows
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.orchard import Setting
from fieldcam.values import TAG_SIZE_MM

_TABLES = ("block_facts", "tree", "cluster", "route", "block_setting", "spray")
_SET_UP = (
    *(f"SELECT id, block FROM {table}" for table in _TABLES),
    "SELECT visit_day.id, visit.block FROM visit_day JOIN visit ON visit.id = visit_day.visit",
)
"""Rows of what is set up in a block."""


@dataclass(frozen=True, slots=True)
class BlockSummary:
    """One block."""

    id: EntryId
    name: str
    orchard: str
    variety: str
    season: int
    trees: int
    clusters: int
    visits: int
    last_day: date | None


@dataclass(frozen=True, slots=True)
class VisitSummary:
    """One visit of a block."""

    id: EntryId
    day: date
    captures: int
    accepted: int
    """Clusters with an accepted picture."""


@dataclass(frozen=True, slots=True)
class DayCorrection:
    """Of a visit's day."""

    given: date
    """The day that it had before."""
    who: str
    """Empty where nobody had signed in."""
    why: str


@dataclass(frozen=True, slots=True)
class SprayRecord:
    """One thinning spray."""

    id: EntryId
    sprayed_on: date
    product: str
    rate: str


def blocks(database: Database) -> tuple[BlockSummary, ...]:
    """All blocks, by name."""
    found = rows(
        database,
        "SELECT block.*,"
        " (SELECT count(*) FROM tree JOIN standing USING (id) WHERE block = block.id) AS trees,"
        " (SELECT count(*) FROM cluster_now WHERE block = block.id) AS clusters,"
        " (SELECT count(*) FROM visit WHERE block = block.id) AS visits,"
        " (SELECT max(day) FROM visit_now WHERE block = block.id) AS last_day"
        " FROM block_now AS block JOIN standing USING (id) ORDER BY block.name",
    )
    return tuple(
        BlockSummary(**{**row, "last_day": row["last_day"] and date.fromisoformat(row["last_day"])})
        for row in found
    )


def block_named(database: Database, name: str) -> BlockSummary | None:
    """The block of this name."""
    return next((block for block in blocks(database) if block.name == name), None)


def newest_blocks(database: Database) -> tuple[EntryId, ...]:
    """All blocks, that which was made, or got a visit, last first; by an import too."""
    found = rows(
        database,
        "SELECT coalesce(visit.block, standing.id) AS block"
        " FROM standing LEFT JOIN visit_now AS visit ON visit.id = standing.id"
        " WHERE standing.kind IN ('block', 'visit') GROUP BY 1 ORDER BY max(turn) DESC",
    )
    return tuple(row["block"] for row in found)


def visits(database: Database, block: EntryId) -> tuple[VisitSummary, ...]:
    """The visits of a block, the earliest day first."""
    found = rows(
        database,
        "SELECT visit.id, visit.day, count(capture.id) AS captures,"
        " count(DISTINCT CASE capture.action WHEN 'accept' THEN capture.tag_id END) AS accepted"
        " FROM visit_now AS visit JOIN entry ON entry.id = visit.id"
        " LEFT JOIN capture_now AS capture ON capture.visit = visit.id"
        " WHERE visit.block = ? GROUP BY visit.id ORDER BY visit.day, entry.turn",
        block,
    )
    return tuple(VisitSummary(**{**row, "day": date.fromisoformat(row["day"])}) for row in found)


def day_corrections(database: Database, block: EntryId) -> dict[EntryId, DayCorrection]:
    """The last word on each visit whose day was corrected."""
    found = rows(
        database,
        "SELECT visit.id, visit.day, operator.name AS who, word.why"
        " FROM visit JOIN visit_day_now AS said ON said.visit = visit.id"
        " JOIN entry AS word ON word.id = said.id LEFT JOIN operator ON operator.id = word.who"
        " WHERE visit.block = ?",
        block,
    )
    return {
        row["id"]: DayCorrection(date.fromisoformat(row["day"]), row["who"] or "", row["why"] or "")
        for row in found
    }


def settings(
    database: Database, block: EntryId, tree: EntryId | None = None
) -> dict[Setting, float]:
    """The numbers that hold for a tree: its own, else the block's."""
    found = rows(
        database,
        "SELECT name, value FROM block_setting_now WHERE block = ? AND (tree IS NULL OR tree = ?)"
        " ORDER BY tree IS NOT NULL",
        block,
        tree,
    )
    return {Setting(row["name"]): row["value"] for row in found}


def tag_size_mm(database: Database, block: EntryId) -> float:
    """Side of the black square of the block's cards."""
    return settings(database, block).get(Setting.TAG_SIZE_MM, TAG_SIZE_MM)


def sprays(database: Database, block: EntryId) -> tuple[SprayRecord, ...]:
    """The sprays of a block, the earliest first."""
    sql = (
        "SELECT spray.id, sprayed_on, product, rate FROM spray JOIN standing USING (id)"
        " WHERE block = ? ORDER BY sprayed_on, turn"
    )
    return tuple(
        SprayRecord(**{**row, "sprayed_on": date.fromisoformat(row["sprayed_on"])})
        for row in rows(database, sql, block)
    )


def trees(database: Database, block: EntryId) -> dict[EntryId, str]:
    """Labels of a block's trees, in the order they were made."""
    sql = "SELECT tree.id, label FROM tree JOIN standing USING (id) WHERE block = ? ORDER BY turn"
    return {row["id"]: row["label"] for row in rows(database, sql, block)}


def tree_of_tags(database: Database, block: EntryId) -> dict[int, str]:
    """Labels of the trees in which the block's tags hang, where that is known."""
    sql = (
        "SELECT cluster.tag_id, tree.label FROM cluster_now AS cluster"
        " JOIN tree ON tree.id = cluster.tree WHERE cluster.block = ?"
    )
    return {row["tag_id"]: row["label"] for row in rows(database, sql, block)}


def last_set_up(database: Database, device: EntryId, block: EntryId) -> EntryId | None:
    """This device's newest standing word on how a block is set up."""
    sql = (
        f"SELECT id FROM standing JOIN ({' UNION ALL '.join(_SET_UP)}) AS word USING (id)"
        " WHERE word.block = ? AND device = ? ORDER BY turn DESC LIMIT 1"
    )
    found = rows(database, sql, block, device)
    return found[0]["id"] if found else None
