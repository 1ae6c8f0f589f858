"""Pictures read in another way are compared under the names of the first reading."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from called_commands import Capture, run
from grown_walks import GROWN, START, grown_field
from made_clusters import made_view, ring
from test_evaluate_command import OFF_MM, caliper_table

from fieldcam.errors import ExitCode, StorageError
from fieldcam.growth.evaluation.named import NamedCluster
from fieldcam.session.over_days import rereading
from fieldcam.session.over_days.evaluating import named_clusters
from fieldcam.store.captures import SavedCapture
from fieldcam.store.queries.blocks import blocks
from fieldcam.store.read_only import ReadOnlyStore, open_read_only
from fieldcam.values import ClusterReading, Expectation, Settings

SMALLER_MM = 0.3
Reread = Callable[[SavedCapture], ClusterReading]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[ReadOnlyStore]:
    with closing(open_read_only(grown_field(tmp_path / "field"))) as opened:
        yield opened


def another_reading(before: ClusterReading) -> ClusterReading:
    """The same fruitlets in another order, each a little smaller, and one that is new."""
    found = [
        replace(f, id=len(before.fruitlets) - 1 - f.id, diameter_mm=f.diameter_mm - SMALLER_MM)
        for f in before.fruitlets
        if f.diameter_mm is not None
    ]
    new = replace(made_view("", ring()).reading.fruitlets[5], id=9)
    return replace(before, fruitlets=(*sorted(found, key=lambda f: f.id), new))


@pytest.fixture(autouse=True)
def other_reader(monkeypatch: pytest.MonkeyPatch) -> None:
    """Answers with what the store holds of the picture, changed."""

    class Reader:
        def __init__(self, *_: object) -> None:
            pass

        def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading:
            with closing(open_read_only(saved.record.parent)) as opened:
                (key,) = (
                    row["id"]
                    for row in opened.database.query(
                        "SELECT id FROM reading WHERE capture = ?", [saved.key]
                    )
                )
                return another_reading(rereading_of(opened, key))

    monkeypatch.setattr(rereading, "DirectAnalyst", Reader)


def rereading_of(store: ReadOnlyStore, key: str) -> ClusterReading:
    from fieldcam.store.readings import stored_reading

    return stored_reading(store.database, key)


def again(store: ReadOnlyStore) -> list[NamedCluster]:
    (block,) = blocks(store.database)
    clusters = named_clusters(store.database, block.id)
    return list(rereading.read_again(store.database, clusters, None, Settings()))  # type: ignore[arg-type]


def test_names_follow_the_masks_into_the_other_reading(store: ReadOnlyStore) -> None:
    for cluster, sizes in zip(again(store), START, strict=True):
        first = cluster.visits[0]
        (view,) = first.views
        named = {
            cluster.names[place]: fruitlet.diameter_mm
            for fruitlet in view.reading.fruitlets
            for place in cluster.names
            if (place.reading, place.fruitlet) == (view.id, fruitlet.id)
        }
        expected = {str(n): mm - SMALLER_MM for n, mm in enumerate(START[sizes], start=1)}
        assert named == pytest.approx(expected)


def test_a_new_fruitlet_of_the_other_reading_has_no_name(store: ReadOnlyStore) -> None:
    for cluster in again(store):
        assert 9 not in {place.fruitlet for place in cluster.names}


def test_pictures_whose_files_are_damaged_are_left_out(
    store: ReadOnlyStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Blind:
        def __init__(self, *_: object) -> None:
            pass

        def analyse(self, *_: object) -> ClusterReading:
            raise StorageError("Its file is gone.")

    monkeypatch.setattr(rereading, "DirectAnalyst", Blind)
    assert [view for c in again(store) for v in c.visits for view in v.views] == []


def test_the_document_has_a_second_pipeline(capsys: Capture, tmp_path: Path) -> None:
    field = grown_field(tmp_path / "walked")
    table = caliper_table(tmp_path / "calipers.csv")
    command = ("evaluate", "--data", field, "--block", "North", "--calipers", table)
    code, out, _ = run(capsys, *command, "--sgbm", "--json")
    assert code == ExitCode.OK
    first, second = json.loads(out)["readings"]
    assert (first["name"], second["name"]) == ("stored readings", "read again with SGBM")
    assert second["sizes"]["all"]["bias_mm"] == pytest.approx(-OFF_MM - SMALLER_MM)
    assert [run["method"] for run in second["end_to_end"]] == ["geometry"]
    assert sum(len(sizes) for sizes in GROWN.values()) * 2 == second["sizes"]["all"]["measured"]
