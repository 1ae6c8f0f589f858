"""A reading that is not what was written is named, left out, and read again."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from grown_walks import grown_field
from hypothesis import given, settings
from hypothesis import strategies as st
from live_walks import read, walked
from made_readings import encoded, made_reading
from stored_walks import MadeWalk, small_store

from fieldcam.cli.main import main
from fieldcam.errors import ExitCode, ReadingDamaged
from fieldcam.session.commands import Accept, GoTo
from fieldcam.session.events import Damaged, Done
from fieldcam.session.state import Stage
from fieldcam.store.connection import rows
from fieldcam.store.queries.resuming import waiting_for_analysis
from fieldcam.store.read_only import open_read_only
from fieldcam.store.readings import reading_row, stored_reading
from fieldcam.store.recovery.startup import startup_check
from fieldcam.store.rows.walk import SEALED_COLUMNS, seal
from fieldcam.store.seals import damaged_readings
from fieldcam.store.store import DATABASE_NAME

Capture = pytest.CaptureFixture[str]


def damage(folder: Path, change: str, which: str = "") -> None:
    """Change columns of the first readings, as a bad disk does behind the database's back."""
    with closing(sqlite3.connect(folder / DATABASE_NAME)) as database:
        database.execute("DROP TRIGGER IF EXISTS no_update_of_reading")
        database.execute("PRAGMA ignore_check_constraints=ON")
        first = "SELECT id FROM entry WHERE kind = 'reading' ORDER BY turn LIMIT 1"
        database.execute(f"UPDATE reading SET {change} WHERE id IN ({which or first})")
        database.commit()


def sealed_anew(folder: Path) -> None:
    with closing(sqlite3.connect(folder / DATABASE_NAME)) as database:
        database.execute("DROP TRIGGER IF EXISTS no_update_of_reading")
        database.execute("UPDATE reading SET sha256 = NULL")
        database.commit()


FLIPS = {
    "a digit of a size": """sizes = replace(sizes, '"diameter_mm":9', '"diameter_mm":8')""",
    "a bracket": "sizes = replace(sizes, '[', '{')",
    "no text": "document = CAST(CAST(substr(document, 1, 50) AS BLOB) || x'ff' AS TEXT)",
    "a digit of the document": """document = replace(document, '"score":0', '"score":1')""",
    "the tag": "tag_read = tag_read + 1",
    "the reasons": "reasons = '[\"none\"]'",
}


@pytest.mark.parametrize("change", FLIPS.values(), ids=FLIPS)
def test_a_damaged_reading_is_left_out_and_named(
    tmp_path: Path, capsys: Capture, change: str
) -> None:
    folder = grown_field(tmp_path)
    damage(folder, change)
    argv = ["--data", str(folder), "growth", "--block", "North", "--json"]
    assert main(argv) == ExitCode.OK
    document = json.loads(capsys.readouterr().out)
    warnings = {each["code"]: each["text"] for each in document["warnings"]}
    assert "tag 11 on 21 May 2026, view 1" in warnings["damaged_readings"]
    assert "unread_pictures" in warnings
    with small_store(folder) as store:
        report = startup_check(store)
        assert any("tag 11 on 21 May 2026, view 1" in each for each in report.sentences)
        assert len(waiting_for_analysis(store.database)) == 1
        assert startup_check(store).damaged == ()


def test_what_is_whole_needs_no_copy(tmp_path: Path) -> None:
    with closing(open_read_only(grown_field(tmp_path))) as store:
        assert store.damaged == ()
        assert store.database.conn.execute("PRAGMA query_only").fetchone() == (1,)


def test_an_unsealed_reading_is_named_where_it_cannot_be_read(tmp_path: Path) -> None:
    folder = grown_field(tmp_path)
    sealed_anew(folder)
    with small_store(folder) as store:
        assert damaged_readings(store.database) == ()
        (first, *_) = rows(store.database, "SELECT id FROM reading")
        stored_reading(store.database, first["id"])
    damage(folder, "document = '{}'", f"'{first['id']}'")
    with small_store(folder) as store, pytest.raises(ReadingDamaged, match="view 1"):
        stored_reading(store.database, first["id"])


def test_damage_in_the_middle_of_a_walk_stops_no_screen(tmp_path: Path) -> None:
    with walked(tmp_path) as walk:
        walk.start()
        walk.shoot(read(11))
        walk.after(Accept(), Done)
        walk.shoot(read(12))
        damage(tmp_path, "document = '{}'")
        walk.live.do(GoTo(11))
        state = walk.heard.until(
            lambda state: (
                state.tag_id == 11
                and state.shown is not None
                and state.shown.stage is Stage.ANALYSING
            )
        )
        assert state.waiting == 1
        told = [each.sentence for each in walk.heard.events if isinstance(each, Damaged)]
        assert told == [
            "The reading of tag 11 on 21 May 2026, view 1 is damaged. Its picture is read again."
        ]


@settings(max_examples=50)
@given(st.integers(0, 2**31), st.integers(0, 7))
def test_every_flipped_bit_of_a_row_is_seen(place: int, bit: int) -> None:
    row = reading_row("capture", encoded(made_reading()), 400.0)
    values = [str(getattr(row, name)).encode() for name in SEALED_COLUMNS]
    joined = max(range(len(values)), key=lambda n: len(values[n]))
    changed = bytearray(values[joined])
    changed[place % len(changed)] ^= 1 << bit
    others = [*values[:joined], bytes(changed), *values[joined + 1 :]]
    assert seal(values) != seal(others)


def test_the_seal_is_that_of_the_stored_row(tmp_path: Path) -> None:
    with small_store(tmp_path) as store:
        walk = MadeWalk(store)
        whole_number = reading_row(walk.accept(walk.visit(), 11), encoded(made_reading()), 400)
        store.append(whole_number)
        assert damaged_readings(store.database) == ()
