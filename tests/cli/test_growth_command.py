"""`fieldcam growth` from a caliper table: the document, the text, and what is refused."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from called_commands import Capture, assert_one_sentence, run
from planned_blocks import Measuring, measured_block

from fieldcam.errors import ExitCode
from fieldcam.exchange.calipers.wide import wide_table
from fieldcam.growth.records import SizeSource
from fieldcam.simulator.plan import BlockPlan

BINDING = (
    "block",
    "from",
    "to",
    "days",
    "reference",
    "cutoff_mm_per_day",
    "initial",
    "persist",
    "abscise",
    "fallen",
    "not_seen",
    "set_pct_of_initial",
    "interval90_pct",
    "warnings",
    "fruitlets",
)


@pytest.fixture
def calipers(tmp_path: Path) -> Path:
    path = tmp_path / "gala.csv"
    record = measured_block(BlockPlan.plan(61, 60), Measuring(SizeSource.CALIPERS, (0, 4, 8)), 61)
    path.write_text(wide_table(record))
    return path


def test_a_table_gets_the_name_of_the_block(capsys: Capture, calipers: Path) -> None:
    _, out, _ = run(capsys, "growth", "--calipers", calipers, "--block", "North", "--json")
    assert json.loads(out)["block"] == "North"


def test_the_document_holds_what_scripts_rely_on(capsys: Capture, calipers: Path) -> None:
    code, out, _ = run(capsys, "growth", "--calipers", str(calipers), "--json")
    found = json.loads(out)
    assert code == ExitCode.OK
    assert tuple(key for key in found if key in BINDING) == BINDING
    assert (found["from"], found["to"], found["days"]) == ("2026-05-14", "2026-05-18", 4)
    assert found["reference"]["n"] == 20
    assert found["cutoff_mm_per_day"] == found["reference"]["rate_mm_per_day"] / 2
    assert found["initial"] == found["persist"] + found["abscise"] + found["not_seen"]
    assert found["set_pct_of_initial"] == pytest.approx(
        100 * found["persist"] / (found["initial"] - found["not_seen"])
    )
    low, high = found["interval90_pct"]
    assert low <= found["set_pct_of_initial"] <= high
    for each in found["fruitlets"]:
        if each["state"] in ("persist", "abscise"):
            faster = each["rate_mm_per_day"] > found["cutoff_mm_per_day"]
            assert faster is (each["state"] == "persist")
            assert {"2026-05-14", "2026-05-18"} <= set(each["sizes_mm"])


def test_size_order_and_days_since_the_spray_stand_beside_it(
    capsys: Capture, calipers: Path
) -> None:
    days = ["2026-05-12", "2026-05-09", "2026-05-19"]
    sprayed = [f"--sprayed={day}" for day in days]
    _, out, _ = run(capsys, "growth", "--calipers", str(calipers), "--json", *sprayed)
    found = json.loads(out)
    assert found["days_since_spray"] == 6
    assert [spray["date"] for spray in found["sprays"]] == [
        "2026-05-12",
        "2026-05-09",
        "2026-05-19",
    ]
    apart = abs(found["by_size_order"]["set_pct_of_initial"] - found["set_pct_of_initial"])
    assert apart > 0
    warned = "size_order_differs" in {each["code"] for each in found["warnings"]}
    assert warned is (apart > 3)
    _, out, _ = run(capsys, "growth", "--calipers", str(calipers), "--json")
    assert json.loads(out)["days_since_spray"] is None


def test_visits_may_be_named(capsys: Capture, calipers: Path) -> None:
    days = ("--from", "2026-05-10", "--to", "2026-05-18")
    _, out, _ = run(capsys, "growth", "--calipers", str(calipers), "--json", *days)
    assert json.loads(out)["days"] == 8


def test_the_text_begins_with_what_it_means(capsys: Capture, calipers: Path) -> None:
    plan = ("--bloom-clusters", "200", "--target", "60", "--sprayed", "2026-05-12")
    code, out, _ = run(capsys, "growth", "--calipers", str(calipers), *plan)
    lines = out.splitlines()
    assert code == ExitCode.OK
    assert lines[0].startswith("Block gala, 2026-05-14 to 2026-05-18: ")
    assert "more than the target of 60: thin again" in lines[1]
    assert "The second visit was 6 days after the last spray." in lines
    assert [line for line in lines if "The last spray was 6 days before" in line]
    assert len(lines[lines.index("Clusters, those that count most first:") :]) == 62


@pytest.mark.parametrize(
    "arguments",
    [
        ("--from", "2026-05-11"),
        ("--from", "2026-05-18", "--to", "2026-05-10"),
        ("--from", "May"),
        ("--dates", "2026-05-10,2026-05-14"),
        ("--dates", ","),
        ("--target", "60"),
        ("--associate", "geometry"),
        ("--same-day", "larger"),
        ("--bloom-clusters", "-1"),
    ],
)
def test_what_does_not_fit_ends_in_one_sentence(
    capsys: Capture, calipers: Path, arguments: tuple[str, ...]
) -> None:
    code, out, err = run(capsys, "growth", "--calipers", str(calipers), *arguments)
    assert_one_sentence(code, out, err, ExitCode.BAD_INPUT)


def test_one_visit_is_not_enough(capsys: Capture, tmp_path: Path) -> None:
    path = tmp_path / "gala.csv"
    path.write_text("date,cluster,fruit,diameter_mm\n2026-05-10,1,1,8.0\n")
    code, _, err = run(capsys, "growth", "--calipers", str(path))
    assert code == ExitCode.BAD_INPUT
    assert "Block gala has only the visit of 2026-05-10; growth needs two." in err


def test_a_table_whose_name_is_no_utf_8_has_a_page(capsys: Capture, tmp_path: Path) -> None:
    table = tmp_path / os.fsdecode(b"caf\xe9.csv")
    table.write_text(
        "cluster,fruit,2026-05-10,2026-05-14\n17,1,8.5,11.0\n17,2,7.0,\n18,1,9.1,12.0\n"
    )
    page = tmp_path / "page.html"
    code, out, _ = run(capsys, "growth", "--calipers", table, "--report", page)
    assert code == ExitCode.OK
    assert "caf" in page.read_text() and "caf" in out


def test_odd_dates_of_a_table_are_warned_of(capsys: Capture, calipers: Path) -> None:
    text = calipers.read_text()
    first = text.splitlines()[0].split("diam.")[1].rstrip(",")
    calipers.write_text(text.replace(first, first.replace("2026", "2025")))
    code, out, _ = run(capsys, "growth", "--calipers", calipers, "--json")
    assert code == ExitCode.OK
    assert json.loads(out)["warnings"][0]["code"] == "two_seasons"
    calipers.write_text(text.replace("2026", "2926"))
    code, out, _ = run(capsys, "growth", "--calipers", calipers)
    assert code == ExitCode.OK
    assert "after today" in out.partition("Warnings:")[2]


def test_what_was_taken_of_empty_cells_is_said(capsys: Capture, calipers: Path) -> None:
    _, out, _ = run(capsys, "growth", "--calipers", calipers)
    assert "taken as fallen" in out.partition("Assumed:")[2]
