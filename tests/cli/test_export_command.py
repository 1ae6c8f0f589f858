"""`fieldcam export wide`: a stored block as a spreadsheet, which `growth` reads back."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from called_commands import Capture, assert_one_sentence, run
from grown_walks import DAYS, grown_field
from stored_walks import small_store

from fieldcam.errors import ExitCode
from fieldcam.store.rows.orchard import Block


@pytest.fixture
def field(tmp_path: Path) -> Path:
    return grown_field(tmp_path / "field")


def test_the_table_gives_the_forecast_of_the_block(
    capsys: Capture, field: Path, tmp_path: Path
) -> None:
    out = tmp_path / "north.csv"
    code, printed, err = run(capsys, "export", "wide", out, "--data", field)
    assert (code, printed) == (ExitCode.OK, "")
    assert "Wrote 8 fruitlets of block North" in err
    stored = json.loads(run(capsys, "growth", "--data", field, "--json")[1])
    table = json.loads(run(capsys, "growth", "--calipers", out, "--json")[1])
    for field_name in ("from", "to", "initial", "persist", "not_seen", "fallen"):
        assert table[field_name] == stored[field_name]
    assert table["reference"]["corrected_mm_per_day"] == pytest.approx(
        stored["reference"]["corrected_mm_per_day"], abs=0.01
    )
    assert table["measured_by"] == stored["measured_by"] == "camera"
    assert "by camera" in table["notes"][0]
    sizes = [row["diam.2026-05-21"] for row in csv.DictReader(out.read_text().splitlines())]
    assert {len(mm.partition(".")[2]) for mm in sizes} == {2}


def test_the_table_is_none_of_calipers(capsys: Capture, field: Path, tmp_path: Path) -> None:
    out = tmp_path / "north.csv"
    run(capsys, "export", "wide", out, "--data", field)
    done = run(capsys, "evaluate", "--data", field, "--block", "North", "--calipers", out)
    assert_one_sentence(*done, ExitCode.BAD_INPUT)
    assert "holds sizes by camera" in done[2]


def test_the_table_has_a_column_for_each_visit(
    capsys: Capture, field: Path, tmp_path: Path
) -> None:
    out = tmp_path / "north.csv"
    run(capsys, "export", "wide", out, "--block", "North", "--data", field)
    heading = next(csv.reader(out.read_text().splitlines()))
    assert heading[:3] == ["tree", "cluster", "fruit"]
    assert heading[3 : 3 + len(DAYS)] == [f"diam.{day}" for day in DAYS]


def test_without_a_name_it_is_the_block_that_growth_takes(
    capsys: Capture, field: Path, tmp_path: Path
) -> None:
    with small_store(field) as store:
        store.visit(store.block(Block("East", "Home", "Gala", 2026)), DAYS[1])
    out = tmp_path / "north.csv"
    assert "of block North" in run(capsys, "export", "wide", out, "--data", field)[2]
    empty = run(capsys, "export", "wide", tmp_path / "e.csv", "--block", "East", "--data", field)
    assert_one_sentence(*empty, ExitCode.BAD_INPUT)
    assert "nothing to export" in empty[2] and not (tmp_path / "e.csv").exists()


def test_it_takes_no_other_files_place(capsys: Capture, field: Path, tmp_path: Path) -> None:
    """A table of calipers may have the same name, and there is only one of it."""
    out = tmp_path / "north.csv"
    out.write_text("precious")
    done = run(capsys, "export", "wide", out, "--data", field)
    assert_one_sentence(*done, ExitCode.BAD_INPUT)
    assert "there already" in done[2] and out.read_text() == "precious"


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        (["export", "wide", "north.txt"], "north.txt must end in .csv"),
        (["export", "wide", "no/where.csv"], "There is no folder"),
        (["export", "wide", "out.csv", "--block", "South"], 'There is no block "South"'),
        (["export", "tall", "out.csv"], "invalid choice"),
    ],
)
def test_bad_input_is_one_sentence(
    capsys: Capture, field: Path, argv: list[str], named: str
) -> None:
    code, out, err = run(capsys, "--data", field, *argv)
    assert_one_sentence(code, out, err, ExitCode.BAD_INPUT)
    assert named in err
