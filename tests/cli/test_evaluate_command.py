"""`fieldcam evaluate`: a stored block against a caliper table."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from called_commands import Capture, assert_one_sentence, run
from checked_pages import words_of
from grown_walks import DAYS, GROWN, START, grown_field
from stored_walks import MadeWalk, small_store

from fieldcam.errors import ExitCode
from fieldcam.store.rows.fruit import CaliperSize

OFF_MM = 0.1
"""The camera reads so much less than the calipers."""


@pytest.fixture
def field(tmp_path: Path) -> Path:
    return grown_field(tmp_path / "field")


def caliper_table(
    path: Path, fruit: str = "{}", days: Sequence[str] = tuple(map(str, DAYS))
) -> Path:
    lines = ["date,cluster,fruit,diameter_mm"]
    for day, sizes in zip(days, (START, GROWN), strict=True):
        for tag_id, of_tag in sizes.items():
            lines += [
                f"{day},{tag_id},{fruit.format(n)},{mm + OFF_MM:.2f}"
                for n, mm in enumerate(of_tag, start=1)
            ]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_clusters_that_only_one_side_has_are_named(
    capsys: Capture, field: Path, tmp_path: Path
) -> None:
    table = caliper_table(tmp_path / "calipers.csv")
    rows = table.read_text().splitlines()
    kept = [re.sub(r",12,(\d),.*", r",99,\1,9.0", row) for row in rows]
    table.write_text("\n".join(kept) + "\n")
    _, out, _ = run(
        capsys, "evaluate", "--data", field, "--block", "North", "--calipers", table, "--json"
    )
    found = json.loads(out)
    (note,) = [note for note in found["notes"] if "forecasts" in note]
    assert "not in the block: 99" in note and "not in the table: 12" in note
    assert found["readings"][0]["end_to_end"][0]["aapd_pct"] == 0.0


def test_the_document_has_the_papers_figures(capsys: Capture, field: Path, tmp_path: Path) -> None:
    table = caliper_table(tmp_path / "calipers.csv")
    code, out, _ = run(
        capsys, "evaluate", "--data", field, "--block", "North", "--calipers", table, "--json"
    )
    assert code == ExitCode.OK
    found = json.loads(out)
    assert (found["block"], found["simulated"]) == ("North", False)
    (readings,) = found["readings"]
    sizes = readings["sizes"]["all"]
    assert (sizes["measured"], sizes["sized_pct"]) == (16, 100.0)
    assert sizes["mae_mm"] == OFF_MM
    assert sizes["bias_mm"] == -OFF_MM and sizes["r2"] == 1.0
    geometry = readings["end_to_end"][0]
    assert geometry["association"] == {
        "right": 8,
        "made": 8,
        "possible": 8,
        "precision_pct": 100.0,
        "recall_pct": 100.0,
    }
    assert found["calipers"]["persist_pct"] is not None
    assert readings["known_association"]["aapd_pct"] is not None
    assert found["seconds_per_cluster"]


def test_a_person_reads_tables_and_the_files_are_written(
    capsys: Capture, field: Path, tmp_path: Path
) -> None:
    table = caliper_table(tmp_path / "calipers.csv")
    files = tmp_path / "figures.csv", tmp_path / "page.html"
    code, out, err = run(
        capsys, "evaluate", "--data", field, "--block", "North", "--calipers", table,
        "--csv", files[0], "--report", files[1],
    )  # fmt: skip
    assert code == ExitCode.OK
    assert str(DAYS[0]) in out and "geometry" in out and "-0.10" in out
    assert all(str(file) in err for file in files)
    rows = list(csv.DictReader(files[0].open()))
    assert {row["block"] for row in rows} == {"North"}
    assert "mean absolute error 0.10 mm" in words_of(files[1].read_text())


def test_sizes_typed_at_the_tag_that_the_table_has_otherwise_are_told(
    capsys: Capture, field: Path, tmp_path: Path
) -> None:
    table = caliper_table(tmp_path / "calipers.csv")
    command = "evaluate", "--data", field, "--block", "North", "--calipers", table, "--json"
    _, out, _ = run(capsys, *command)
    assert json.loads(out)["notes"] == []
    with small_store(field) as store:
        block = MadeWalk(store).block
        for fruit, mm in (("1", START[11][0] + OFF_MM), ("2", 3.0), ("3", 4.0), ("9", 9.0)):
            store.append(CaliperSize(block, 11, DAYS[0], fruit, mm))
    _, out, _ = run(capsys, *command)
    (note,) = json.loads(out)["notes"]
    assert "2 with another value in the table, 1 not in it at all; only the table" in note


@pytest.mark.parametrize(
    ("days", "why"),
    [
        ((str(DAYS[0]), "2026-07-01"), f"Camera and calipers share {DAYS[0]}"),
        ((str(DAYS[1]), "2026-07-01"), f"Camera and calipers share {DAYS[1]}"),
    ],
)
def test_one_shared_visit_has_sizes_and_no_forecast(
    capsys: Capture, field: Path, tmp_path: Path, days: tuple[str, str], why: str
) -> None:
    table = caliper_table(tmp_path / "calipers.csv", days=days)
    code, out, _ = run(
        capsys, "evaluate", "--data", field, "--block", "North", "--calipers", table, "--json"
    )
    found = json.loads(out)
    assert code == ExitCode.OK
    assert found["calipers"]["persist_pct"] is None
    assert any(why in note for note in found["notes"])
    assert found["readings"][0]["sizes"][days[0]]["measured"] == 8


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"--block": "South"}, 'Blocks: "North".'),
        ({"--calipers": "missing.csv"}, "missing.csv"),
        ({"--calipers": "nameless.csv"}, "never by size"),
        ({"--calipers": "others.csv"}, "same tag, name and day"),
        ({"--report": "page.txt"}, "must end in .html"),
        ({"--csv": "nowhere/figures.csv"}, "nowhere"),
    ],
    ids=lambda change: " ".join(change) if isinstance(change, dict) else "",
)
def test_what_cannot_be_evaluated_is_told_in_one_sentence(
    capsys: Capture,
    field: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    change: dict[str, str],
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    caliper_table(tmp_path / "calipers.csv")
    caliper_table(tmp_path / "nameless.csv", fruit="")
    caliper_table(tmp_path / "others.csv", fruit="red {}")
    options = {"--data": str(field), "--block": "North", "--calipers": "calipers.csv"} | change
    done = run(capsys, "evaluate", *(part for option in options.items() for part in option))
    assert_one_sentence(*done, ExitCode.BAD_INPUT)
    assert says in done[2]


def test_without_a_data_folder_nothing_is_made(capsys: Capture, tmp_path: Path) -> None:
    table = caliper_table(tmp_path / "calipers.csv")
    done = run(
        capsys, "evaluate", "--data", tmp_path / "none", "--block", "North", "--calipers", table
    )
    assert_one_sentence(*done, ExitCode.STORAGE)
    assert not (tmp_path / "none").exists()
