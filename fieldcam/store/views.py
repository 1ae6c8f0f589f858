"""Views of the rows that count now, made of the kinds of rows.

They hold no rows, so a database that is opened to write gets this version's ones; a step
of `sql/` only makes tables. For each kind that can be undone or said anew there is
`<table>_now`, with each row's turn.
"""

from __future__ import annotations

from functools import cache

from sqlite_utils import Database

from fieldcam.store.connection import rows, writing
from fieldcam.store.rows.judgements import Decision, TagCorrection
from fieldcam.store.rows.kinds import KINDS
from fieldcam.store.rows.orchard import BlockFacts
from fieldcam.store.rows.row import Row
from fieldcam.store.rows.walk import Reading

_LAST = "ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1"
"""The largest turn, and where two devices did not know of each other the later clock.

The id only settles ties.
"""


def last_word(kind: type[Row], about: str) -> str:
    """Of the rows that were not undone and that the condition on `other` holds for, the id."""
    return (
        f"SELECT other.id FROM {kind.table} AS other JOIN standing AS word ON word.id = other.id"
        f" WHERE ({about}) {_LAST}"
    )


def _now(kind: type[Row]) -> str:
    if not kind.key:
        return (
            f"SELECT said.*, standing.turn FROM {kind.table} AS said"
            " JOIN standing ON standing.id = said.id"
        )
    return (
        f"SELECT said.*, entry.turn FROM {kind.table} AS said JOIN entry ON entry.id = said.id"
        f" WHERE said.id = ({last_word(kind, kind.key)})"
    )


_STANDING = f"""
SELECT * FROM entry
WHERE coalesce((
    SELECT undo.undone FROM undo JOIN entry AS word ON word.id = undo.id
    WHERE undo.target = entry.id {_LAST}
), 0) = 0
"""
"""Rows that were not undone."""

_BLOCK = f"""
SELECT
    block.id AS id,
    block.name AS name,
    coalesce(facts.orchard, block.orchard) AS orchard,
    coalesce(facts.variety, block.variety) AS variety,
    coalesce(facts.season, block.season) AS season
FROM block
LEFT JOIN block_facts AS facts ON facts.id = ({last_word(BlockFacts, "other.block = block.id")})
"""

_VISIT = """
SELECT visit.id AS id, visit.block AS block, coalesce(said.day, visit.day) AS day
FROM visit LEFT JOIN visit_day_now AS said ON said.visit = visit.id
"""

_CAPTURE = f"""
SELECT
    capture.*,
    entry.turn AS turn,
    reading.id AS reading,
    decision.id AS decision,
    decision.action AS action,
    coalesce(
        tag_correction.tag_id,
        CASE decision.action WHEN 'accept' THEN reading.tag_read END,
        capture.tag_expected,
        reading.tag_read
    ) AS tag_id
FROM capture
JOIN entry ON entry.id = capture.id
LEFT JOIN reading ON reading.id = ({last_word(Reading, "other.capture = capture.id")})
LEFT JOIN decision ON decision.id = ({last_word(Decision, "other.capture = capture.id")})
LEFT JOIN tag_correction
    ON tag_correction.id = ({last_word(TagCorrection, "other.capture = capture.id")})
"""
"""An accepted picture belongs to the tag that it shows, any other one to the tag that was
asked for: a picture of the wrong tag must not end the search for the right one.

(Joining the views of these kinds would cost a scan of each.)
"""

_TAG_CANDIDATE = """
SELECT tag_expected AS tag_id, id AS capture FROM capture
UNION ALL SELECT tag_read, capture FROM reading
UNION ALL SELECT tag_id, capture FROM tag_correction
"""
"""The captures that may belong to a tag; looking only at these spares looking at all."""

_FRUITLET = """
SELECT
    reading.id AS reading,
    reading.capture AS capture,
    json_extract(size.value, '$.id') AS fruitlet,
    json_extract(size.value, '$.cluster') AS cluster,
    json_extract(size.value, '$.diameter_mm') AS diameter_mm,
    json_extract(size.value, '$.sd_mm') AS sd_mm,
    coalesce(
        (
            SELECT target.cluster IS json_extract(size.value, '$.cluster')
            FROM target_correction_now AS target WHERE target.reading = reading.id
        ),
        json_extract(size.value, '$.in_target')
    ) AS in_target,
    NOT EXISTS (
        SELECT 1 FROM fruitlet_mark_now AS mark
        WHERE mark.reading = reading.id
            AND mark.fruitlet = json_extract(size.value, '$.id')
            AND mark.mark IN ('fallen', 'not_a_fruitlet')
    ) AS living
FROM reading_now AS reading, json_each(reading.sizes) AS size
"""
"""The fruitlets of each capture's last reading, with corrections and marks applied."""

_COUNT = """
SELECT
    reading.capture AS capture,
    (
        SELECT count(*) FROM fruitlet_now AS fruitlet
        WHERE fruitlet.capture = reading.capture AND fruitlet.in_target AND fruitlet.living
    ) + (
        SELECT coalesce(sum(mark.count), 0) FROM fruitlet_mark_now AS mark
        WHERE mark.reading = reading.id AND mark.fruitlet IS NULL AND mark.mark = 'added_by_hand'
    ) AS living
FROM reading_now AS reading
"""
"""Living fruitlets of the target cluster that a capture shows."""


@cache
def views() -> dict[str, str]:
    """What makes each view, by its name."""
    of_kinds = {f"{kind.table}_now": _now(kind) for kind in KINDS if kind.named or kind.key}
    selects = {
        "standing": _STANDING,
        **of_kinds,
        "block_now": _BLOCK,
        "visit_now": _VISIT,
        "capture_now": _CAPTURE,
        "tag_candidate": _TAG_CANDIDATE,
        "fruitlet_now": _FRUITLET,
        "count_now": _COUNT,
    }
    return {name: f"CREATE VIEW {name} AS {select.strip()}" for name, select in selects.items()}


def renew_views(database: Database) -> None:
    """Make those that the file does not have as they are here; in most files none."""
    if stale_views(database):
        with writing(database):
            # Another process may have done it while this one waited for the lock.
            for name in stale_views(database):
                database.execute(f"DROP VIEW IF EXISTS {name}")
                database.execute(views()[name])


def stale_views(database: Database) -> list[str]:
    """Names of those that are missing, or those of another version."""
    found = rows(database, "SELECT name, sql FROM sqlite_schema WHERE type = 'view'")
    known = {row["name"]: row["sql"] for row in found}
    return [name for name, sql in views().items() if known.get(name) != sql]
