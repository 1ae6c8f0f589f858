"""A visit whose day was wrong: the word on it counts on screens, in growth, export and import."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from datetime import date, timedelta
from pathlib import Path

import pytest
from called_commands import Capture, run
from grown_walks import GROWN, LATER_DAYS, START, grown_field, photograph
from stored_walks import FIRST_DAY, MadeWalk, small_store

from fieldcam.growth.places import Association
from fieldcam.growth.visits import visits_of
from fieldcam.session.over_days.block_growth import block_record, known_clusters
from fieldcam.session.over_days.days import block_days, cluster_days
from fieldcam.session.over_days.growing import block_rows
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.store.connection import rows
from fieldcam.store.queries.blocks import block_named, day_corrections, visits
from fieldcam.store.queries.calipers import caliper_sizes, measured_twice, named_fruitlets
from fieldcam.store.queries.resuming import resume
from fieldcam.store.queries.walks import expectation
from fieldcam.store.rows.fruit import CaliperSize
from fieldcam.store.store import Store

WRONG, RIGHT = date(2000, 1, 1), FIRST_DAY + timedelta(days=LATER_DAYS)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    """The later of two visits was walked by a clock that stood at the year 2000."""
    with small_store(tmp_path) as found:
        walk = MadeWalk(found)
        for day, sizes in ((FIRST_DAY, START), (WRONG, GROWN)):
            visit = found.visit(walk.block, day)
            for tag_id, of_tag in sizes.items():
                photograph(walk, visit, tag_id, of_tag)
        yield found


@pytest.fixture
def setup(store: Store) -> SetUp:
    found = SetUp(store, lambda: FIRST_DAY)
    found.sign_in("Ana")
    north = block_named(store.database, "North")
    assert north is not None
    found.block = north.id
    return found


def wrong_visit(setup: SetUp) -> str:
    return next(visit.id for visit in setup.state().visits if visit.day == WRONG)


def correct(setup: SetUp) -> str:
    visit = wrong_visit(setup)
    said = setup.correct_day(visit, RIGHT, "the battery was flat")
    assert said == "The visit of 01 Jan 2000 was on 25 May 2026."
    return visit


def block(setup: SetUp) -> str:
    assert setup.block is not None
    return setup.block


def test_a_correction_says_who_and_why_and_changes_no_row(store: Store, setup: SetUp) -> None:
    visit = correct(setup)
    (word,) = day_corrections(store.database, block(setup)).items()
    assert word[0] == visit
    assert (word[1].given, word[1].who, word[1].why) == (WRONG, "Ana", "the battery was flat")
    kept = rows(store.database, "SELECT day FROM visit WHERE id = ?", visit)
    assert kept == [{"day": "2000-01-01"}]


def test_the_corrected_day_counts_everywhere(store: Store, setup: SetUp) -> None:
    database = store.database
    wrong = [visit.day for visit in visits(database, block(setup))]
    visit = correct(setup)
    days = [FIRST_DAY, RIGHT]
    assert wrong == [WRONG, FIRST_DAY]
    assert [each.day for each in visits(database, block(setup))] == days
    assert [each.day for each in block_days(database, block(setup))] == days
    assert [each.day for each in cluster_days(database, block(setup), 11)] == days
    assert [
        record.day for day in cluster_days(database, block(setup), 11) for record in day.pictures
    ] == days
    known = tuple(known_clusters(database, block_rows(database, block(setup)), {}))
    record = block_record(database, block(setup), known, Association.GEOMETRY)
    assert [each.first for each in visits_of(record)] == days
    assert sorted({each.day for each in named_fruitlets(database, block(setup))}) == days
    assert expectation(database, visit, 11).fruitlets == len(START[11])
    assert store.visit(block(setup), RIGHT) == visit
    assert store.visit(block(setup), WRONG) != visit
    north = block_named(database, "North")
    assert north is not None and north.last_day == RIGHT


def test_a_correction_can_be_corrected_and_undone(store: Store, setup: SetUp) -> None:
    visit = correct(setup)
    setup.correct_day(visit, RIGHT + timedelta(days=1))
    last = resume(store.database, visit)
    assert last is not None and last.day == RIGHT + timedelta(days=1)
    setup.undo()
    last = resume(store.database, visit)
    assert last is not None and last.day == RIGHT


def test_two_halves_of_a_day_count_as_one(store: Store, setup: SetUp) -> None:
    """As when the clock was put right at noon."""
    said = setup.correct_day(wrong_visit(setup), FIRST_DAY)
    assert said.endswith("That day has two visits now, which count as one.")
    known = tuple(known_clusters(store.database, block_rows(store.database, block(setup)), {}))
    record = block_record(store.database, block(setup), known, Association.GEOMETRY)
    assert [each.days for each in visits_of(record)] == [(FIRST_DAY,)]


def test_sizes_by_caliper_go_with_their_visit(store: Store, setup: SetUp) -> None:
    def matched() -> list[date]:
        sizes = caliper_sizes(store.database, block(setup))
        return [
            each.day
            for each in measured_twice(sizes, named_fruitlets(store.database, block(setup)))
        ]

    store.append(
        CaliperSize(block(setup), 11, WRONG, "1", 11.8),
        CaliperSize(block(setup), 11, FIRST_DAY, "1", 9.1),
        CaliperSize(block(setup), 11, WRONG, "2", 9.0, source="table.csv"),
    )
    before = caliper_sizes(store.database, block(setup))
    correct(setup)
    assert matched() == [FIRST_DAY, RIGHT]
    assert [s.day for s in caliper_sizes(store.database, block(setup)) if s.source] == [WRONG]
    setup.undo()
    assert caliper_sizes(store.database, block(setup)) == before


def test_export_and_forecast_have_the_corrected_day(tmp_path: Path, capsys: Capture) -> None:
    folder = grown_field(tmp_path / "data")
    with small_store(folder) as store:
        setup = SetUp(store, lambda: FIRST_DAY)
        setup.resume()
        last = setup.state().visits[-1]
        setup.correct_day(last.id, last.day + timedelta(days=1))
    table = tmp_path / "sizes.csv"
    assert run(capsys, "--data", folder, "export", "wide", table)[0] == 0
    heading = next(csv.reader(table.open()))
    assert [column for column in heading if column.startswith("diam.")] == [
        "diam.2026-05-21",
        "diam.2026-05-26",
    ]
    _, told, _ = run(capsys, "--data", folder, "growth")
    assert "2026-05-26" in told and "2026-05-25" not in told
