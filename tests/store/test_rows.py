"""A kind of rows is said on its class alone: reading, undoing and the last word follow."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date, datetime
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stored_walks import MadeWalk, small_store

from fieldcam.store.connection import connect, rows
from fieldcam.store.migrations import migrate
from fieldcam.store.rows.judgements import Action, MarkKind
from fieldcam.store.rows.kinds import KINDS, SET_UP, WORDS
from fieldcam.store.rows.row import Row, columns, from_columns
from fieldcam.store.rows.walk import Reading
from fieldcam.store.views import views

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
SIZES = st.tuples(st.fixed_dictionaries({"id": st.integers(0, 9), "diameter_mm": NUMBERS}))


def rows_of(kind: type[Row]) -> st.SearchStrategy[Row]:
    if kind is Reading:
        texts = st.dictionaries(st.text(), st.text())
        return st.builds(Reading, sizes=SIZES, models=texts, duration_ms=NUMBERS)
    return st.builds(kind)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.table)
def test_what_is_written_is_read_back(kind: type[Row]) -> None:
    @settings(max_examples=25)
    @given(rows_of(kind))
    def check(row: Row) -> None:
        assert from_columns(kind, {"id": "of no field", **columns(row)}) == row

    check()


@dataclass(frozen=True)
class Mixed:
    """Of types that rows do not have, or only some of them."""

    day: date | None
    at: datetime
    marks: tuple[MarkKind, ...]
    known: bool
    other: tuple[Action, ...] | None = None


def test_columns_of_a_query_become_what_the_fields_are() -> None:
    row = {"day": None, "at": "2026-05-21T09:00:40+00:00", "marks": '["king"]', "known": 1}
    found = from_columns(Mixed, {**row, "other": (Action.ACCEPT,)})
    at = datetime.fromisoformat("2026-05-21T09:00:40+00:00")
    assert found == Mixed(None, at, (MarkKind.KING,), True, (Action.ACCEPT,))
    assert found.known is True
    for missing in ("day", "known"):
        with pytest.raises(KeyError):
            from_columns(Mixed, {name: value for name, value in row.items() if name != missing})


def test_a_kind_with_a_subject_has_a_name() -> None:
    """Which the operator is told when one is undone."""
    assert all(kind.named for kind in (*WORDS, *SET_UP))


def test_views_of_another_version_are_replaced(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        walk = MadeWalk(store)
        walk.accept(walk.visit(), 11)
    database = connect(tmp_path / "fieldcam.db")
    database.execute("DROP VIEW capture_now")
    database.execute("CREATE VIEW capture_now AS SELECT 1 AS another")
    database.execute("DROP VIEW note_now")
    migrate(database, tmp_path / "fieldcam.db")
    found = rows(database, "SELECT name, sql FROM sqlite_schema WHERE type = 'view'")
    assert {row["name"]: row["sql"] for row in found} == views()
    assert [row["action"] for row in rows(database, "SELECT * FROM capture_now")] == ["accept"]
    changed = database.conn.total_changes
    migrate(database, tmp_path / "fieldcam.db")
    assert database.conn.total_changes == changed
    database.close()
