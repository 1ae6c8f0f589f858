"""Dates that no season has: told before a forecast or a comparison is believed."""

from __future__ import annotations

import json
from datetime import date, timedelta
from pathlib import Path

import pytest
from called_commands import Capture, run
from grown_walks import DAYS, GROWN, START, grown_field

from fieldcam.growth.warnings.dates import doubtful_dates, other_year

TODAY = date(2026, 5, 30)
SIZES = ((8.8, 10.5, 12.2), (6.4, 7.4, 8.3), (7.7, 8.8, 8.9), (7.5, 10.1, 12.6))


def days(*texts: str) -> list[date]:
    return [date.fromisoformat(text) for text in texts]


@pytest.mark.parametrize(
    ("visits", "codes"),
    [
        (("2026-05-10", "2026-05-14", "2026-05-18"), []),
        (("2025-12-28", "2026-01-03"), []),
        (("2025-05-10", "2026-05-14", "2026-05-18"), ["two_seasons"]),
        (("2026-05-10", "2026-05-14", "2027-05-18"), ["future_dates", "two_seasons"]),
        (("2026-05-29", "2026-05-30", "2026-05-31"), ["future_dates"]),
        (("2062-05-10", "2062-05-14"), ["future_dates"]),
        (("0026-05-10", "0026-05-14"), ["odd_year"]),
        (("1926-05-10", "2026-05-14"), ["odd_year", "two_seasons"]),
        (("2024-05-10", "2025-05-14", "2026-05-18"), ["two_seasons", "two_seasons"]),
        (("2026-02-05", "2026-05-09"), ["long_interval"]),
    ],
)
def test_each_doubt_about_dates_has_its_code(visits: tuple[str, ...], codes: list[str]) -> None:
    assert [code for code, _ in doubtful_dates(days(*visits), TODAY)] == codes


def test_made_up_days_lie_in_no_future() -> None:
    assert list(doubtful_dates(days("2062-05-10", "2062-05-14"))) == []


def table(path: Path, visits: list[date]) -> Path:
    heading = ",".join(["tree,cluster,fruit", *(f"diam.{day}" for day in visits)])
    lines = [f"1,11,{n},{','.join(map(str, sizes))}" for n, sizes in enumerate(SIZES, 1)]
    path.write_text("\n".join([heading, *lines, ""]))
    return path


@pytest.mark.parametrize(
    ("visits", "code"),
    [
        (("2025-05-10", "2026-05-14", "2026-05-18"), "two_seasons"),
        (("2162-05-10", "2162-05-14", "2162-05-18"), "future_dates"),
    ],
)
def test_a_table_with_such_dates_is_told_first(
    tmp_path: Path, capsys: Capture, visits: tuple[str, ...], code: str
) -> None:
    calipers = table(tmp_path / "sizes.csv", days(*visits))
    _, out, _ = run(capsys, "growth", "--calipers", calipers, "--json")
    assert json.loads(out)["warnings"][0]["code"] == code


def evaluated(tmp_path: Path, capsys: Capture, years: int) -> tuple[int, str, str]:
    """The stored block against its own sizes, as a table of other years would have them."""
    field = grown_field(tmp_path / "field")
    heading = ",".join(f"diam.{day.replace(year=day.year + years)}" for day in DAYS)
    lines = [
        f"1,{tag},{n + 1},{first},{second}"
        for tag in START
        for n, (first, second) in enumerate(zip(START[tag], GROWN[tag], strict=True))
    ]
    calipers = tmp_path / "sizes.csv"
    calipers.write_text("\n".join([f"tree,cluster,fruit,{heading}", *lines, ""]))
    return run(capsys, "--data", field, "evaluate", "--block", "North", "--calipers", calipers)


def test_a_table_of_another_year_than_the_pictures_is_told(tmp_path: Path, capsys: Capture) -> None:
    code, _, err = evaluated(tmp_path, capsys, -1)
    assert code == 2
    assert "But for the year 2025-05-21, 2025-05-25 would be of the pictures (2026)" in err


def test_a_table_of_the_right_year_is_not(tmp_path: Path, capsys: Capture) -> None:
    code, out, _ = evaluated(tmp_path, capsys, 0)
    assert code == 0 and "year" not in out


def test_days_of_other_months_are_no_other_year() -> None:
    here = set(days("2026-05-10"))
    assert other_year(here, set(days("2026-05-10"))) == ""
    assert other_year(here, set(days("2025-05-11"))) == ""
    assert other_year(here, {day - timedelta(days=365) for day in here}) != ""
