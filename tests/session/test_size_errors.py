"""The standard deviation of a size goes wherever the size goes; unknown, it stays unknown."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from called_commands import Capture, run
from checked_pages import words_of
from grown_walks import DAYS, LATER_DAYS, grown_field
from hypothesis import given
from hypothesis import strategies as st
from made_clusters import made_view, ring
from made_readings import TAG, encoded, made_fruitlet, made_reading
from stored_walks import FIRST_DAY, MadeWalk, small_store

from fieldcam.codec.forms import FruitletForm
from fieldcam.growth.size_rule import SizeRule, sighting_of
from fieldcam.session.over_days.days import cluster_days
from fieldcam.store.connection import rows
from fieldcam.store.queries.calipers import caliper_sizes, measured_twice, named_fruitlets
from fieldcam.store.queries.history import capture_record
from fieldcam.store.readings import reading_row
from fieldcam.store.rows.fruit import CaliperIdentity, CaliperSize
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.row import EntryId
from fieldcam.values import Fruitlet

Known = tuple[float | None, float | None]
"""A size and its standard deviation, mm."""


@pytest.fixture
def walk(tmp_path: Path) -> Iterator[MadeWalk]:
    with small_store(tmp_path) as store:
        yield MadeWalk(store)


def seen(number: int, known: Known) -> Fruitlet:
    size_mm, sd_mm = known
    return made_fruitlet(number, (100.0 + 30 * number, 100.0), size_mm, sd_mm=sd_mm)


def read(walk: MadeWalk, visit: EntryId, sizes: Sequence[Known]) -> tuple[EntryId, EntryId]:
    """A picture of tag 11, and its reading."""
    capture = walk.take(visit, 11).key
    fruitlets = [seen(n, known) for n, known in enumerate(sizes)]
    reading = made_reading(fruitlets, tag=replace(TAG, id=11))
    return capture, walk.store.append(reading_row(capture, encoded(reading), 400.0))[0]


def test_a_reading_keeps_it_for_the_screens(walk: MadeWalk) -> None:
    sizes = ((9.0, 0.11), (8.0, None), (None, None))
    capture, reading = read(walk, walk.visit(), sizes)
    record = capture_record(walk.store.database, capture)
    assert record is not None and record.reading is not None
    assert tuple((each.diameter_mm, each.sd_mm) for each in record.reading.target) == sizes
    sql = "SELECT diameter_mm, sd_mm FROM fruitlet_now WHERE reading = ? ORDER BY fruitlet"
    assert tuple(tuple(row.values()) for row in rows(walk.store.database, sql, reading)) == sizes


def test_beside_calipers_the_better_known_size_stands(walk: MadeWalk) -> None:
    visit = walk.visit()
    for sizes in ([(9.0, 0.11), (8.0, None)], [(8.0, 0.09), (7.0, 0.3)]):
        _, reading = read(walk, visit, sizes)
        walk.store.append(*(CaliperIdentity(reading, n, f"fl{n}") for n in range(2)))
    measured = [CaliperSize(walk.block, 11, FIRST_DAY, f"fl{n}", 7.9) for n in range(2)]
    walk.store.append(*measured)
    database = walk.store.database
    named = named_fruitlets(database, walk.block)
    assert [each.sd_mm for each in named] == [0.11, None, 0.09, 0.3]
    both = measured_twice(caliper_sizes(database, walk.block), named)
    assert [each.camera_mm for each in both] == [8.0, 7.0]


def test_a_file_that_knew_no_errors_has_unknown_ones(
    walk: MadeWalk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its fruitlets are counted as before."""

    def without(fruitlet: FruitletForm) -> dict[str, Any]:
        return {"id": fruitlet.id, "in_target": fruitlet.in_target, "diameter_mm": 9.0}

    with monkeypatch.context() as patch:
        patch.setattr("fieldcam.store.readings._size", without)
        capture, _ = read(walk, walk.visit(), [(9.0, 0.1), (9.0, 0.2)])
    found = rows(walk.store.database, "SELECT diameter_mm, sd_mm FROM fruitlet_now")
    assert found == [{"diameter_mm": 9.0, "sd_mm": None}] * 2
    (count,) = rows(walk.store.database, "SELECT * FROM count_now")
    assert count == {"capture": capture, "living": 2}


SECOND_VIEW = ((11.6, 0.05), (9.3, 0.3), (9.1, None), (None, None))
"""Of fruitlets that the first view sized as 12.0, 9.0, 9.5 and 8.9 mm, each ±0.1."""
COUNT = [(11.6, 0.05), (9.0, 0.1), (9.5, 0.1), (8.9, 0.1)]


def test_growth_and_screens_take_the_same_view(capsys: Capture, tmp_path: Path) -> None:
    field = grown_field(tmp_path / "field", sd_mm=0.1)
    with small_store(field) as store:
        walk = MadeWalk(store)
        spheres = [
            replace(sphere, sd_mm=sd)
            for sphere, (_, sd) in zip(ring(mm for mm, _ in SECOND_VIEW), SECOND_VIEW, strict=True)
        ]
        reading = made_view("", spheres).reading
        assert reading.tag is not None
        reading = replace(reading, tag=replace(reading.tag, id=11))
        capture = walk.take(walk.visit(LATER_DAYS), 11).key
        store.append(
            reading_row(capture, encoded(reading), 400.0), Decision(capture, Action.ACCEPT)
        )
        day = cluster_days(store.database, walk.block, 11)[1]
        assert sorted(day.sizes_mm) == sorted(mm for mm, _ in COUNT)
    _, out, _ = run(capsys, "growth", "--data", field, "--json")
    of_cluster = [each for each in json.loads(out)["fruitlets"] if each["tag"] == 11]
    end = str(DAYS[1])
    found = [(each["sizes_mm"][end], each["sds_mm"][end]) for each in of_cluster]
    assert sorted(found) == sorted(COUNT)
    page = tmp_path / "north.html"
    run(capsys, "growth", "--data", field, "--report", page)
    text = words_of(page.read_text())
    assert "9.00 ±0.10 → 11.60 ±0.05 stays" in text
    _, out, _ = run(capsys, "growth", "--data", field, "--json", "--associate", "paper")
    sizes = [each["sizes_mm"].get(end) for each in json.loads(out)["fruitlets"]]
    assert 12.0 in sizes and 9.3 in sizes


def test_unknown_errors_are_not_told(capsys: Capture, tmp_path: Path) -> None:
    field, page = grown_field(tmp_path / "field"), tmp_path / "north.html"
    _, out, _ = run(capsys, "growth", "--data", field, "--json", "--report", page)
    assert all(each["sds_mm"] == {} for each in json.loads(out)["fruitlets"])
    assert "9.0 → 12.0 stays" in words_of(page.read_text())


VIEWS = st.lists(
    st.tuples(
        st.none() | st.floats(3.0, 25.0),
        st.none() | st.floats(0.01, 0.5),
    ),
    max_size=6,
)


@given(VIEWS)
def test_what_counts_is_one_of_the_views(views: list[Known]) -> None:
    fruitlets = [seen(n, known) for n, known in enumerate(views)]
    sized = [each for each in fruitlets if each.diameter_mm is not None]
    known = [each.sd_mm for each in sized if each.sd_mm is not None]
    for rule in SizeRule:
        chosen = rule.chosen(fruitlets)
        assert (chosen is None) is (not sized)
        counts = sighting_of(fruitlets, rule)
        assert chosen is None or chosen in sized
        assert counts.diameter_mm == (None if chosen is None else chosen.diameter_mm)
        assert counts.sd_mm == (None if chosen is None else chosen.sd_mm)
    better, larger = (rule.chosen(fruitlets) for rule in SizeRule)
    if better is not None and larger is not None:
        assert better.sd_mm == min(known, default=None)
        assert larger.diameter_mm == max(each.diameter_mm or 0.0 for each in sized)
