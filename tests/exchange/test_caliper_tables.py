"""Caliper tables: every shape in use is read, and what is wrong is named with its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from openpyxl import Workbook
from planned_blocks import Measuring, measured_block

from fieldcam.errors import BadInput
from fieldcam.exchange.calipers.reading import CaliperTable, read_calipers
from fieldcam.exchange.calipers.wide import wide_table
from fieldcam.growth.forecast import forecast
from fieldcam.growth.records import BlockRecord, Presence, Sighting, SizeSource
from fieldcam.growth.visits import chosen_interval, visits_of
from fieldcam.simulator.plan import BlockPlan

FIRST, SECOND = date(2026, 5, 10), date(2026, 5, 14)
EXPECTED = {(17, "1"): (8.5, 11.0), (17, "2"): (7.0, None), (18, "1"): (9.1, 12.0)}
"""Sizes on the two days; the one without has fallen."""
ROWS = "1,17,1,8.5,11.0\n1,17,2,7.0,\n2,18,1,9.1,12.0\n"
WIDE = "tree,cluster,fruit,diam.2026-05-10,diam.2026-05-14\n" + ROWS
LONG = (
    "date,cluster,fruit,diameter_mm\n2026-05-10,17,1,8.5\n2026-05-10,17,2,7.0\n"
    "2026-05-10,18,1,9.1\n2026-05-14,17,1,11.0\n2026-05-14,17,2,\n2026-05-14,18,1,12.0\n"
)


def read(folder: Path, text: str | bytes, dates: Sequence[date] = ()) -> CaliperTable:
    path = folder / "gala.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_calipers(path, dates)


def sizes(record: BlockRecord) -> dict[tuple[int, str], tuple[float | None, ...]]:
    return {
        (each.tag_id, each.fruitlet): tuple(
            each.sightings[day].diameter_mm if day in each.sightings else None
            for day in record.visits
        )
        for each in record.fruitlets
    }


GOOD: dict[str, str | bytes] = {
    "wide": WIDE,
    "wide, the newer day first": "tree,cluster,fruit,diam.2026-05-14,diam.2026-05-10\n"
    "1,17,1,11.0,8.5\n1,17,2,,7.0\n2,18,1,12.0,9.1\n",
    "wide, without trees, dates alone": "cluster,fruit,2026-05-10,2026-05-14\n"
    "17,1,8.5,11.0\n17,2,7.0,NA\n18,1,9.1,12.0\n",
    "wide from R": WIDE.replace("05-1", "05.1").replace("2026-", "2026."),
    "wide with a byte order mark and Windows lines": b"\xef\xbb\xbf"
    + WIDE.replace("\n", "\r\n").encode(),
    "wide with tabs and odd headings": WIDE.replace(",", "\t").replace("cluster", " Tag "),
    "wide with decimal commas": WIDE.replace(",", ";")
    .replace(".0\n", ",0\n")
    .replace("8.5", "8,5"),
    "wide with quoted decimal commas": WIDE.replace("8.5", '"8,5"'),
    "wide without the last separators": WIDE.replace("7.0,\n", "7.0\n"),
    "long": LONG,
    "long without the fallen": LONG.replace("2026-05-14,17,2,\n", ""),
    "long with times": LONG.replace("-10,", "-10 09:30:00,").replace("-14,", "-14T18:05,"),
    "wide with times": WIDE.replace("05-10", "05-10 09:30:00").replace("05-14", "05-14T7:30"),
    "long in any order": LONG.splitlines()[0] + "\n" + "\n".join(LONG.splitlines()[:0:-1]),
    "long with other dates": LONG.replace("2026-05-10", "10.05.2026").replace(
        "-14", "-14 00:00:00"
    ),
    "wide with a line that says the separator": "sep=;\n" + WIDE.replace(",", ";"),
    "wide below a title": "Gala, block 7;;;;\n\n" + WIDE.replace(",", ";").replace("8.5", "8,5"),
    "wide below a date of its own": "Printed;2026-06-01\n" + WIDE.replace(",", ";"),
    "wide with units below the names": WIDE.replace("-14\n", "-14\n,,,mm,(mm)\n"),
    "wide with units behind the names": WIDE.replace("-10", "-10 (mm)").replace("-14", "-14 [mm]"),
    "wide below dates": "tree,cluster,fruit,2026-05-10,,2026-05-14,\n,,,diam,note,diam,note\n"
    + "1,17,1,8.5,,11.0,\n1,17,2,7.0,,,gone\n2,18,1,9.1,windy,12.0,\n",
    "wide with dates above the names": ",,,2026-05-10,,2026-05-14,\n"
    + "tree,cluster,fruit,Diam (mm),note,Diam (mm),note\n"
    + "1,17,1,8.5,,11.0,\n1,17,2,7.0,,,gone\n2,18,1,9.1,windy,12.0,\n",
    "wide with dates below the names": "tree,cluster,fruit,diameter (mm),\n"
    + ",,,2026-05-10,2026-05-14\n"
    + ROWS,
    "wide with visits above dates": "tree,cluster,fruit,Visit 1,Visit 2\n,,,2026-05-10,2026-05-14\n"
    + ROWS,
    "wide with its heading again": WIDE + WIDE.splitlines()[0] + "\n2,19,1,,\n",
    "wide with merged cells": WIDE.replace("1,17,2", ",,2"),
    "wide with spurs and notes": WIDE.replace("cluster,fruit", "Spur No.,Fruit #").replace(
        "-14\n", "-14,note,note\n"
    ),
    "wide with other dates": WIDE.replace("2026-05-10", "5/10/2026").replace(
        "2026-05-14", "5/14/2026"
    ),
    "wide with a word": WIDE.replace("7.0,\n", "7.0,Dropped\n"),
    "wide with units in the cells": WIDE.replace("8.5", "8.5 mm"),
    "wide, as Excel's Unicode text": WIDE.replace(",", "\t").encode("utf-16"),
    "long with dates written once": LONG.replace("2026-05-10,17,2", ",,2")
    .replace("2026-05-10,18", ",18")
    .replace("2026-05-14,17,2", ",,2"),
    "long with fruit written once": "date,cluster,fruit,diameter_mm\n2026-05-10,17,1,8.5\n"
    "2026-05-14,,,11.0\n2026-05-10,,2,7.0\n2026-05-10,18,1,9.1\n2026-05-14,,,12.0\n",
    "tags and fruit with dates in a column": "date,tag,fl1,fl2\n2026-05-10,17,8.5,7\n"
    "2026-05-10,18,9.1,\n2026-05-14,17,11,\n2026-05-14,18,12,\n",
    "long with numbers of spreadsheets": LONG.replace(",17,", ",17.0,").replace(",1,", ",1.0,"),
}


@pytest.mark.parametrize("text", GOOD.values(), ids=GOOD)
def test_what_spreadsheets_write_is_read(tmp_path: Path, text: str | bytes) -> None:
    record = read(tmp_path, text).record
    assert sizes(record) == EXPECTED
    assert (record.name, record.source, record.visits) == (
        "gala",
        SizeSource.CALIPERS,
        (FIRST, SECOND),
    )
    fallen = next(each for each in record.fruitlets if each.fruitlet == "2")
    assert fallen.sightings[SECOND].presence is Presence.FALLEN


def test_the_shape_of_the_peers_needs_dates(tmp_path: Path) -> None:
    numbered = WIDE.replace("2026-05-10", "1").replace("2026-05-14", "2,diam.3")
    record = read(tmp_path, numbered, (FIRST, SECOND)).record
    assert sizes(record) == EXPECTED
    assert record.tree_of == {17: "1", 18: "2"}
    gap = "tree,cluster,fruit,diam.1,diam.2,diam.3\n" + ROWS.replace("8.5,", "8.5,,").replace(
        "7.0,", "7.0,,"
    ).replace("9.1,", "9.1,,")
    assert sizes(read(tmp_path, gap, (FIRST, SECOND)).record) == EXPECTED
    empty = read(tmp_path, gap, (FIRST, date(2026, 5, 12), SECOND))
    assert sizes(empty.record) == EXPECTED
    assert empty.notes[0].startswith("Without any size, and so no visit: 2026-05-12.")


def workbook(path: Path, sheets: Mapping[str, Sequence[Sequence[object]]]) -> Path:
    book = Workbook()
    book.remove(book.worksheets[0])
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


HEADING = ("tag", "fl1", "fl2")
SHEETS: dict[str, list[tuple[object, ...]]] = {
    "2026-05-10": [HEADING, (17, 8.5, 7), (18, 9.1, None)],
    "2026-05-14": [HEADING, (17, 11, None), (18.0, "12,0", None)],
}


def test_sheets_without_rows_are_told(tmp_path: Path) -> None:
    empty: dict[str, list[tuple[object, ...]]] = {"2026-05-18": [HEADING], "notes": [("windy",)]}
    found = read_calipers(workbook(tmp_path / "gala.xlsx", SHEETS | empty))
    assert found.notes[:2] == (
        "Sheets that hold no caliper table were left out: notes.",
        "Sheets without rows were left out: 2026-05-18.",
    )


def test_the_authors_workbook(tmp_path: Path) -> None:
    found = read_calipers(workbook(tmp_path / "gala.xlsx", {**SHEETS, "notes": [("rain",)]}))
    assert sizes(found.record) == EXPECTED
    assert "Sheets that hold no caliper table were left out: notes." in found.notes


def test_a_fruit_of_the_authors_has_one_name_in_all_shapes(tmp_path: Path) -> None:
    rows = "cluster,fruit,diam.2026-05-10\n17,fl1,8.5\n17,FL 02,7\n17,3.0,9\n17,king,9.5\n"
    assert {fruit for _, fruit in sizes(read(tmp_path, rows).record)} == {"1", "2", "3", "king"}


BAD_SHEETS: dict[str, tuple[dict[str, list[tuple[object, ...]]], str]] = {
    "no dates": (
        {"may": [HEADING, (17, 8.0, 9.0)]},
        "gala.xlsx, sheet may: the column date is missing.",
    ),
    "no year": (
        {"10 May": [HEADING, (17, 8.0, 9.0)]},
        "gala.xlsx, sheet 10 May: '10 May' has no year.",
    ),
    "no fruit": (
        {"2026-05-10": [("tag", "a")]},
        "gala.xlsx has no heading of a caliper table; it begins with 'tag a'.",
    ),
    "no number": (
        {"2026-05-10": [HEADING, (17, 8.0, "big")]},
        "gala.xlsx, sheet 2026-05-10, cell C2: 'big' is no diameter",
    ),
    "a tag twice": (
        {"2026-05-10": [HEADING, (17, 8.0), (17, 8.0)]},
        "gala.xlsx, sheet 2026-05-10, row 3: tag 17 is in row 2 already.",
    ),
    "a formula that was never computed": (
        {"2026-05-10": [HEADING, (17, "=8+1")]},
        "gala.xlsx, sheet 2026-05-10, cell B2: its formula",
    ),
}


@pytest.mark.parametrize(("sheets", "message"), BAD_SHEETS.values(), ids=BAD_SHEETS)
def test_what_is_wrong_in_a_workbook_is_named_with_its_cell(
    tmp_path: Path, sheets: dict[str, list[tuple[object, ...]]], message: str
) -> None:
    path = workbook(tmp_path / "gala.xlsx", sheets)
    with pytest.raises(BadInput) as refused:
        read_calipers(path)
    assert refused.value.message.startswith(message)


def test_the_content_says_what_a_file_is(tmp_path: Path) -> None:
    path = tmp_path / "gala.csv"
    workbook(tmp_path / "gala.xlsx", SHEETS).rename(path)
    assert sizes(read_calipers(path).record) == EXPECTED
    path = tmp_path / "gala.xlsx"
    path.write_text(WIDE)
    assert sizes(read_calipers(path).record) == EXPECTED


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"no workbook", "has no heading of a caliper table; it begins with 'no workbook'"),
        (b"PK\x03\x04", "is no workbook that can be read"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "of Excel 97 to 2003, or is locked by a password"),
        (b"%PDF-1.4\xff", "is no text in UTF-8"),
    ],
)
def test_files_that_are_no_workbooks(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "gala.xlsx"
    path.write_bytes(content)
    with pytest.raises(BadInput, match=message):
        read_calipers(path)
    with pytest.raises(BadInput, match="There is no table"):
        read_calipers(tmp_path / "none.xlsx")
    with pytest.raises(BadInput, match="is a pipe or a device"):
        read_calipers(Path("/dev/zero"))


BAD = {
    "": "gala.csv is empty.",
    "\n\n": "gala.csv is empty.",
    "a,b,c\n1,2,3\n": "gala.csv has no heading of a caliper table; it begins with 'a b c'.",
    "date,fruit,diameter_mm\n": "gala.csv: the column cluster is missing.",
    "date,cluster,fruit,diameter_mm\n": "gala.csv holds no sizes.",
    WIDE.replace("8.5", "8,5"): "gala.csv, line 2: there are 6 cells below 5 headings; are commas",
    WIDE.replace("8.5", "big"): "gala.csv, line 2, column diam.2026-05-10: 'big' is no diameter",
    WIDE.replace("8.5", "-8.5"): "gala.csv, line 2, column diam.2026-05-10: -8.5 mm is no",
    WIDE.replace("8.5", "0"): "gala.csv, line 2, column diam.2026-05-10: 0 mm is no diameter.",
    WIDE.replace("8.5", "850"): "gala.csv, line 2, column diam.2026-05-10: 850 mm is no size",
    WIDE.replace("8.5", "1e1"): "gala.csv, line 2, column diam.2026-05-10: '1e1' is no diameter",
    WIDE.replace("2026-05-14", "2026-05-10 "): "gala.csv, line 1: there are two columns",
    WIDE.replace("2026-05-14", "2026.05.10"): "gala.csv, line 2, column diam.2026.05.10: fruit 1 of"
    " cluster 17 on 2026-05-10 is in line 2, column diam.2026-05-10 already.",
    WIDE.replace("2026-05-14", "2026-02-30"): "gala.csv, line 1, column diam.2026-02-30:"
    " '2026-02-30' is no date.",
    WIDE.replace("2026-05-14", "05/06/2026"): "gala.csv, line 1, column diam.05/06/2026:"
    " '05/06/2026' is 2026-06-05 (the day first) or 2026-05-06 (the month first), and nothing",
    WIDE.replace("diam.2026-05-10", "visit_1").replace(
        "2026-05-14", "1"
    ): "gala.csv: columns visit_1 and diam.1 are of one visit.",
    WIDE.replace("2026-05-10", "10-May"): "gala.csv, line 1, column diam.10-may: '10-may' has no",
    WIDE.replace(",", ";").replace("8.5", "8;5"): "gala.csv, line 2: there are 6 cells below 5"
    " headings; the last is '11.0'.",
    WIDE.replace("7.0,", "fallen,8.0"): "gala.csv, line 3, column diam.2026-05-14: fruit 2 of"
    " cluster 17 has a size on 2026-05-14, but is 'fallen' on 2026-05-10 (line 3, column",
    WIDE.replace("1,17,2", "1,17,1"): "gala.csv, line 3, column diam.2026-05-10: fruit 1 of cluster"
    " 17 on 2026-05-10 is in line 2, column diam.2026-05-10 already.",
    WIDE.replace("1,17,2", "2,17,2"): "gala.csv, line 3, column diam.2026-05-10: cluster 17 is on"
    " tree 2, but on tree 1 in line 2",
    WIDE.replace("1,17,2", "2,,2"): "gala.csv, line 3: the cluster is missing.",
    WIDE.replace(
        "1,17,2", "1,,1"
    ): "gala.csv, line 3, column diam.2026-05-10: fruit 1 of cluster 17 on 2026-05-10 is in line 2",
    "tree,cluster,fruit,2026-05-10\n,,2,7.0\n": "gala.csv, line 2: the cluster is missing.",
    WIDE.replace("1,17,2", "1,A,2"): "gala.csv, line 3: 'A' is no cluster number.",
    WIDE.replace("1,17,2", "1,17,"): "gala.csv, line 3: the fruit has no name.",
    WIDE.replace("diam.2026-05-10", "diam.1"): "gala.csv: column diam.1 has a number, others",
    WIDE.replace("2026-05-10", "1").replace("2026-05-14", "2"): "gala.csv numbers its visits",
    LONG.replace("diameter_mm", "diameter_cm"): "gala.csv: column diameter_cm seems to be in cent",
    LONG.replace(
        "diameter_mm", "diameter_in"
    ): "gala.csv: column diameter_in seems to be in inches",
    LONG.replace("diameter_mm", "diam (inch)"): "gala.csv: column diam_inch seems to be in inches",
    LONG.replace("diameter_mm", "Size [in]"): "gala.csv: column size_in seems to be in inches",
    LONG.replace(
        "diameter_mm", "Diameter in inches"
    ): "gala.csv: column diameter_inches seems to be",
    LONG.replace(
        "diameter_mm", "Diameter [\u00b5m]"
    ): "gala.csv: column diameter_\u00b5m seems to be in micrometres",
    WIDE.replace("diam.2026-05-10", "diam.2026-05-10 (in)"): "gala.csv: column diam.2026-05-10_in",
    LONG.replace("2026-05-14,17,1", "2026-05-14,17,"): "gala.csv, line 5, column diameter_mm: this",
    LONG.replace(
        "2026-05-14,17,1", "14/15/26,17,1"
    ): "gala.csv, line 5, column date: '14/15/26' is",
    "date,cluster,fruit,diameter_mm\n2026-05-10,17,1,0.85\n2026-05-10,17,2,1.2\n": "gala.csv: the"
    " sizes of 2026-05-10 are 1 in the middle; are they in centimetres?",
    WIDE.replace("8.5", "2.9").replace("7.0", "2.6").replace("9.1", "3.0"): "gala.csv: the sizes of"
    " 2026-05-10 are 2.9 in the middle; are they in centimetres?",
    WIDE.replace("11.0", "1.1").replace("12.0", "1.2"): "gala.csv: the sizes of 2026-05-14 are 1.1",
}


@pytest.mark.parametrize("heading", ["Diameter in mm", "Diameter (mm)", "diam, mm", "Size [mm]"])
def test_millimetres_may_be_named(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "gala.csv"
    path.write_text(LONG)
    plain = read_calipers(path).record
    path.write_text(LONG.replace("diameter_mm", f'"{heading}"'))
    assert read_calipers(path).record == plain


@pytest.mark.parametrize("text", BAD)
def test_what_is_wrong_is_named_with_its_place(tmp_path: Path, text: str) -> None:
    with pytest.raises(BadInput) as refused:
        read(tmp_path, text)
    assert refused.value.message.startswith(BAD[text])


@pytest.mark.parametrize(
    ("text", "dates", "message"),
    [
        (WIDE, (FIRST, SECOND), "gala.csv names its own dates."),
        (LONG, (FIRST, SECOND), "gala.csv names its own dates."),
        ("numbered", (SECOND, FIRST), "The dates 2026-05-14, 2026-05-10 are not in order."),
        ("numbered", (FIRST,), "gala.csv has sizes of 2 visits, but --dates names 1."),
    ],
)
def test_dates_that_do_not_fit(
    tmp_path: Path, text: str, dates: tuple[date, ...], message: str
) -> None:
    numbered = WIDE.replace("2026-05-10", "1").replace("2026-05-14", "2")
    with pytest.raises(BadInput) as refused:
        read(tmp_path, numbered if text == "numbered" else text, dates)
    assert refused.value.message == message


NOTED = {
    "decimal commas": (GOOD["wide with decimal commas"], "gala.csv has commas as decimals"),
    "other order": (GOOD["wide, the newer day first"], "The dates of gala.csv are not in order"),
    "an empty column": (WIDE.replace("-14\n", "-14,diam.2026-05-20\n"), "Without any size, and so"),
    "words for nothing": (
        WIDE.replace("7.0,\n", "7.0,NA\n"),
        "gala.csv says NA or the like in 1 cell, and leaves none empty: read as empty cells.",
    ),
    "what fell": (
        WIDE,
        "Without a size to the end, and so taken as fallen: 1 fruit (1 on 2026-05-14).",
    ),
    "an empty row": (WIDE + "2,18,2,,\n", "Left out: 1 fruit without any size."),
    "no names": (
        "date,cluster,fruit,diameter_mm\n2026-05-10,17,,7.0\n2026-05-10,17,,8.5\n"
        "2026-05-14,17,,11.0\n2026-05-10,18,,9.1\n2026-05-14,18,,12\n",
        "Fruits have no names: within each cluster they were paired by size order",
    ),
}


@pytest.mark.parametrize(("text", "note"), NOTED.values(), ids=NOTED)
def test_what_was_assumed_is_said(tmp_path: Path, text: str | bytes, note: str) -> None:
    found = read(tmp_path, text)
    assert sizes(found.record) == EXPECTED
    assert [each for each in found.notes if each.startswith(note)]


def test_clusters_numbered_anew_on_each_tree(tmp_path: Path) -> None:
    rows = [f"{tree},{cluster},1,8.0,9.0" for tree in (1, 2) for cluster in (1, 2, 3)]
    found = read(tmp_path, WIDE.splitlines()[0] + "\n" + "\n".join(rows))
    assert [each.tag_id for each in found.record.fruitlets] == [11, 12, 13, 21, 22, 23]
    assert found.notes == (
        "gala.csv numbers the clusters anew on each tree: cluster 1 of tree 1 is called 11 here,"
        " and so on.",
    )


WORDS = {
    "blank": ("", "", Presence.FALLEN, Presence.FALLEN),
    "fallen, and blank": ("fallen", "", Presence.FALLEN, Presence.NOT_SEEN),
    "not measured, and blank": ("Not measured", "", Presence.NOT_SEEN, Presence.FALLEN),
    "both words": ("fallen", "n.m.", Presence.FALLEN, Presence.NOT_SEEN),
    "NA alone": ("NA", "na", Presence.FALLEN, Presence.FALLEN),
    "NA beside blank": ("NA", "", Presence.NOT_SEEN, Presence.FALLEN),
}


@pytest.mark.parametrize(("one", "other", "first", "second"), WORDS.values(), ids=WORDS)
def test_blank_fallen_and_not_measured_are_three_things(
    tmp_path: Path, one: str, other: str, first: Presence, second: Presence
) -> None:
    text = WIDE.replace("7.0,\n", f"7.0,{one}\n") + f"2,18,2,6.0,{other}\n"
    found = read(tmp_path, text)
    known = {(f.tag_id, f.fruitlet): f.sightings[SECOND].presence for f in found.record.fruitlets}
    assert (known[17, "2"], known[18, "2"]) == (first, second)


def test_a_word_for_fallen_makes_blank_not_measured_and_says_so(tmp_path: Path) -> None:
    text = WIDE.replace("7.0,\n", "7.0,fallen\n") + "2,18,2,6.0,\n"
    assert read(tmp_path, text).notes == (
        "Blank to the end where others are said to have fallen, and so taken as not measured:"
        " 1 fruit (1 on 2026-05-14).",
    )


def test_a_cluster_that_is_said_to_be_passed_over_is_not_emptied(tmp_path: Path) -> None:
    text = unfinished(0).replace("1,1,1,8.0,9.0,10.0", "1,1,1,8.0,not measured,nm")
    found = read(tmp_path, text)
    assert 1 not in found.record.visited[SECOND]
    fruit = next(each for each in found.record.fruitlets if each.tag_id == 1)
    assert fruit.sightings[SECOND].presence is Presence.NOT_SEEN


def test_trees_and_clusters_numbered_anew_in_each_row(tmp_path: Path) -> None:
    rows = [f"{r},{tree},{tag},1,8.0,9.0" for r in (1, 2) for tree in (1, 2) for tag in (1, 2)]
    text = "row,tree,cluster,fruit,2026-05-10,2026-05-14\n" + "\n".join(rows)
    found = read(tmp_path, text)
    assert list(found.record.tree_of.values()) == sorted(2 * ["1-1", "1-2", "2-1", "2-2"])
    assert found.notes[0].startswith("Trees are numbered anew in each row: tree 1 of row 1 is")


ONE_SHEET: dict[str, list[tuple[object, ...]]] = {
    "wide": [
        ("tree", "cluster", "fruit", date(2026, 5, 10), date(2026, 5, 14)),
        (1, 17, 1, 8.5, 11),
        (None, None, 2, 7, None),
        (2, 18, 1, 9.1, 12),
    ],
    "long": [
        ("date", "cluster", "fruit", "diameter"),
        *((date(2026, 5, 10), tag, fruit, mm) for tag, fruit, mm in ((17, 1, 8.5), (17, 2, 7))),
        (date(2026, 5, 10), 18, 1, 9.1),
        *((date(2026, 5, 14), tag, 1, mm) for tag, mm in ((17, 11), (18, 12))),
    ],
}


@pytest.mark.parametrize("rows", ONE_SHEET.values(), ids=ONE_SHEET)
@pytest.mark.parametrize("name", ["Sheet1", "Fruit 2026"])
def test_a_workbook_with_any_sheet_name(
    tmp_path: Path, name: str, rows: list[tuple[object, ...]]
) -> None:
    found = read_calipers(workbook(tmp_path / "gala.xlsx", {name: rows, "Notes": [("rain",)]}))
    assert sizes(found.record) == EXPECTED


def test_sheet_names_are_dates_together(tmp_path: Path) -> None:
    renamed = {f"5-{day}-2026": rows for day, rows in zip((10, 14), SHEETS.values(), strict=True)}
    summary: dict[str, list[tuple[object, ...]]] = {"Means": [HEADING, (17, 9.0, 9.0)]}
    found = read_calipers(workbook(tmp_path / "gala.xlsx", renamed | summary))
    assert sizes(found.record) == EXPECTED
    assert found.notes[0].endswith("have no column of dates, were left out: Means.")


def test_days_and_months_that_a_program_swapped_are_refused(tmp_path: Path) -> None:
    """A program of the other order takes 01/08/2022 for 8 January, and leaves 17/06/2022."""
    rows: list[tuple[object, ...]] = [
        ("date", "cluster", "fruit", "diameter"),
        ("17/06/2022", 17, 1, 8.5),
        (date(2022, 1, 8), 17, 1, 11.0),
    ]
    with pytest.raises(BadInput, match=r"2022-01-08 may be 2022-08-01, since '17/06/2022'"):
        read_calipers(workbook(tmp_path / "gala.xlsx", {"Data": rows}))


def unfinished(lost: int, later: str = "") -> str:
    """Ten clusters, of which the first `lost` have no size on the second visit."""
    heading = "tree,cluster,fruit,diam.2026-05-10,diam.2026-05-14,diam.2026-05-18\n"
    rows = (
        f"1,{tag},1,8.0,{'' if tag <= lost else 9.0},{later if tag <= lost else 10.0}"
        for tag in range(1, 11)
    )
    return heading + "\n".join(rows)


@pytest.mark.parametrize(
    ("text", "presence"),
    [
        (unfinished(3), Presence.FALLEN),
        (unfinished(6), None),
        (unfinished(3, later="10.0"), None),
    ],
)
def test_a_cluster_without_sizes(tmp_path: Path, text: str, presence: Presence | None) -> None:
    """All fallen; not measured when most have none, or when it has some later."""
    found = read(tmp_path, text)
    first = next(each for each in found.record.fruitlets if each.tag_id == 1)
    seen = first.sightings.get(SECOND)
    assert (seen and seen.presence) is presence
    assert (1 in found.record.visited[SECOND]) is (presence is not None)


def test_a_visit_over_two_days_empties_no_cluster(tmp_path: Path) -> None:
    """Clusters 1 and 2 are measured a day before the others; cluster 2 has lost its fruit."""
    rows = ["cluster,fruit,2026-05-10,2026-05-11,2026-05-14,2026-05-15"]
    for cluster in range(1, 11):
        cells = ["8.0", "", "11.0", ""] if cluster < 3 else ["", "8.0", "", "11.0"]
        rows.append(f"{cluster},a," + ",".join(cells))
        rows.append(f"{cluster},b," + ",".join([*cells[:2], "", ""]))
    rows[3] = "2,a,8.0,,,"
    record = read(tmp_path, "\n".join(rows)).record
    found = forecast(record, *chosen_interval(record))
    assert [str(visit) for visit in visits_of(record)] == ["2026-05-10/11", "2026-05-14/15"]
    assert (found.counts.initial, found.counts.persist, found.counts.fallen) == (20, 9, 11)


def test_an_unfinished_visit_is_said(tmp_path: Path) -> None:
    found = read(tmp_path, unfinished(6))
    assert found.notes[0].startswith("On 2026-05-14 6 of 10 clusters have no size at all")


def test_a_gap_is_not_a_fall(tmp_path: Path) -> None:
    text = unfinished(0) + "\n1,1,2,7.0,,8.0\n"
    fruit = next(f for f in read(tmp_path, text).record.fruitlets if f.fruitlet == "2")
    assert fruit.sightings[SECOND].presence is Presence.NOT_SEEN


CELL = st.none() | st.integers(35, 200).map(lambda tenths: tenths / 10)
TABLES = st.dictionaries(
    st.tuples(st.integers(0, 20), st.integers(1, 5)),
    st.lists(CELL, min_size=3, max_size=3).filter(lambda cells: any(cells)),
    min_size=1,
    max_size=25,
)


@settings(max_examples=60)
@given(TABLES)
def test_a_wide_table_comes_back_as_it_was(
    tmp_path_factory: pytest.TempPathFactory, cells: dict[tuple[int, int], list[float | None]]
) -> None:
    folder = tmp_path_factory.getbasetemp()
    heading = "tree,cluster,fruit,diam.2026-05-10,diam.2026-05-14,diam.2026-05-18\n"
    rows = (
        f"T{tag // 7},{tag},{fruit}," + ",".join("" if mm is None else str(mm) for mm in known)
        for (tag, fruit), known in cells.items()
    )
    record = read(folder, heading + "\n".join(rows)).record
    again = read(folder, wide_table(record)).record
    assert again == record
    assert "state" not in wide_table(record) and "measured_by" not in wide_table(record)


@pytest.mark.parametrize("seed", range(3))
def test_what_a_camera_did_not_see_comes_back(tmp_path: Path, seed: int) -> None:
    record = measured_block(BlockPlan.plan(seed, 20), Measuring(SizeSource.CAMERA, (0, 3, 7)), seed)
    found = read(tmp_path, wide_table(record))
    again = found.record
    assert again.source is SizeSource.CAMERA
    assert found.notes[0].startswith("gala.csv holds sizes by camera")
    for one, other in zip(again.fruitlets, record.fruitlets, strict=True):
        assert [s.presence for s in one.sightings.values()] == [
            s.presence for s in other.sightings.values()
        ]
        for day, seen in one.sightings.items():
            assert seen.diameter_mm == pytest.approx(other.sightings[day].diameter_mm, abs=0.0051)


def test_sizes_by_camera_and_by_calipers_do_not_mix(tmp_path: Path) -> None:
    mixed = "cluster,fruit,2026-05-10,measured_by\n17,1,8.5,camera\n17,2,7.0,\n"
    with pytest.raises(BadInput, match="mixes sizes by camera and by calipers"):
        read(tmp_path, mixed)
    assert read(tmp_path, mixed.replace(",camera", ",Ana")).record.source is SizeSource.CALIPERS


@given(content=st.binary(max_size=200))
def test_fuzz_any_table_is_read_or_refused_in_one_sentence(
    content: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    try:
        read(tmp_path_factory.getbasetemp(), WIDE.encode() + content)
    except BadInput as refused:
        assert "\n" not in str(refused)


@pytest.fixture(scope="module")
def good_workbook(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Made once: a workbook holds the time at which it was written."""
    return workbook(tmp_path_factory.mktemp("good") / "gala.xlsx", SHEETS).read_bytes()


@settings(max_examples=40)
@given(data=st.data())
def test_fuzz_a_damaged_workbook_is_read_or_refused(
    data: st.DataObject, good_workbook: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Letters of one of its parts are changed; or bytes of the file itself, where none is."""
    path = tmp_path_factory.getbasetemp() / "damaged.xlsx"
    with ZipFile(BytesIO(good_workbook)) as whole:
        parts = {name: bytearray(whole.read(name)) for name in whole.namelist()}
    spoilt = data.draw(st.sampled_from([*parts, "the file"]))
    damaged = parts.get(spoilt, bytearray(good_workbook))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(damaged) - 1))
        damaged[at] = data.draw(st.integers(32, 126))
    if spoilt in parts:
        with ZipFile(path, "w") as written:
            for name, content in parts.items():
                written.writestr(name, bytes(content))
    else:
        path.write_bytes(damaged)
    try:
        read_calipers(path)
    except BadInput as refused:
        assert "\n" not in str(refused)


def test_a_tree_with_the_name_of_a_formula_leaves_as_text_and_comes_back(tmp_path: Path) -> None:
    record = read(tmp_path, WIDE.replace("2,18", "=2+5,18")).record
    written = wide_table(record)
    assert "\n'=2+5,18," in written
    assert read(tmp_path, written).record.tree_of[18] == "=2+5"


def test_more_fruit_than_any_block_has_is_refused(tmp_path: Path) -> None:
    rows = "".join(f"{tag},{fruit},8.0,9.0\n" for tag in range(500) for fruit in range(61))
    with pytest.raises(BadInput, match="holds more than 30,000 fruits: that is no table"):
        read(tmp_path, "cluster,fruit,2026-05-10,2026-05-14\n" + rows)


def test_doubts_about_a_camera_s_matches_leave_and_come_back(tmp_path: Path) -> None:
    record = measured_block(BlockPlan.plan(3, 8), Measuring(SizeSource.CAMERA, (0, 4)), 3)
    first, *others = record.fruitlets
    day = record.visits[-1]
    sightings = {record.visits[0]: Sighting(Presence.SIZED, 8.0)}
    doubted = replace(
        first, sightings=sightings | {day: Sighting(Presence.SIZED, 19.0, confidence=0.5349)}
    )
    table = wide_table(replace(record, fruitlets=(doubted, *others)))
    head, row, *_ = table.splitlines()
    assert head.endswith(f",sure.{day},measured_by,doubt")
    assert row.endswith(
        f',0.53,camera,"53 % sure on {day}, 2.8 mm/day to {day}, which no fruitlet grows"'
    )
    again = read(tmp_path, table).record.fruitlets[0]
    assert again.sightings[day].confidence == 0.53
    with pytest.raises(BadInput, match="'sure' is no certainty from 0 to 1"):
        read(tmp_path, table.replace(",0.53,", ",sure,"))
