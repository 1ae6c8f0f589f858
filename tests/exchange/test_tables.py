"""Tables of spreadsheets: dates are read together, sheets of any program within bounds."""

from __future__ import annotations

import time
from datetime import date
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import pytest
from hypothesis import given
from hypothesis import strategies as st
from openpyxl import Workbook

from fieldcam.errors import BadInput
from fieldcam.exchange.tables.dates import WrittenDate, calendar_of
from fieldcam.exchange.tables.files import read_sheets
from fieldcam.exchange.tables.written import as_named, as_text, csv_text

DAY = date(2026, 5, 10)


def read(*texts: str) -> list[date]:
    calendar = calendar_of(WrittenDate(text, f"line {n}") for n, text in enumerate(texts, start=2))
    return [calendar.days[text] for text in texts]


@pytest.mark.parametrize(
    "text",
    [
        "2026-05-10",
        "2026/5/10",
        "2026.05.10",
        "20260510",
        "10.05.2026",
        "10.5.26",
        "10-May-2026",
        "10-may-26",
        "10/May/2026",
        "10 May 2026",
        "10th May 2026",
        "May 10, 2026",
        "May-10-2026",
        "may_10,_2026",
        "Sunday, May 10, 2026",
        "10. Mai 2026",
        "10 de mayo de 2026",
        "10 maggio 2026",
        "46152",
        "46152.75",
        "2026-05-10 09:30",
        "2026-05-10T23:40:11.123-04:00",
        "2026-05-10T23:40:11.123+0200",
        "2026-05-10 10:34:24-0500",
        "2026-05-10T03:40:11Z",
        "2026-05-10 9:30:00 PM",
        "10.05.2026 09:30",
    ],
)
def test_dates_with_one_meaning(text: str) -> None:
    assert read(text) == [DAY]


@pytest.mark.parametrize(
    ("texts", "days"),
    [
        (("5/10/2026", "5/14/2026"), ("2026-05-10", "2026-05-14")),
        (("17/06/2022", "01/08/2022"), ("2022-06-17", "2022-08-01")),
        (("5-10-2026", "5-14-2026"), ("2026-05-10", "2026-05-14")),
        (("05/10/26", "05/14/26"), ("2026-05-10", "2026-05-14")),
        (("14/05/26", "18/05/26"), ("2026-05-14", "2026-05-18")),
        (("26-05-10", "26-05-14"), ("2026-05-10", "2026-05-14")),
        (("5/10/2026 14:30", "5/14/2026 2:30 PM"), ("2026-05-10", "2026-05-14")),
        (("5/5/2026",), ("2026-05-05",)),
        (("2026-05-10", "5/14/2026"), ("2026-05-10", "2026-05-14")),
    ],
)
def test_all_dates_together_say_what_each_means(
    texts: tuple[str, ...], days: tuple[str, ...]
) -> None:
    assert read(*texts) == [date.fromisoformat(day) for day in days]


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (
            ("5/2/2026", "5/6/2026"),
            "line 2: '5/2/2026' is 2026-02-05 (the day first) or 2026-05-02 (the month first), and"
            " nothing beside it says which.",
        ),
        (
            ("5/14/2026", "14/5/2026"),
            "line 2: '5/14/2026' has the month first, but '14/5/2026' has the day first (line 3).",
        ),
        (("10-May",), "line 2: '10-May' has no year."),
        (("5/10",), "line 2: '5/10' has no year."),
        (("10.05.",), "line 2: '10.05.' has no year."),
        (("2026-02-30",), "line 2: '2026-02-30' is no date."),
        (("13/13/2026",), "line 2: '13/13/2026' is no date."),
        (("4615",), "line 2: '4615' is no date."),
        (("",), "line 2: '' is no date."),
    ],
)
def test_dates_that_are_refused(texts: tuple[str, ...], message: str) -> None:
    with pytest.raises(BadInput) as refused:
        read(*texts)
    assert refused.value.message == message


def test_what_was_assumed_of_dates_is_said() -> None:
    texts = ("5/10/2026", "5/14/2026", "46160", "2026-05-22T03:40:11Z")
    notes = calendar_of(WrittenDate(text, "") for text in texts).notes
    assert [note.partition(" ")[0] for note in notes] == [texts[0], texts[2], texts[3]]


@pytest.mark.parametrize(
    ("zone", "is_utc"),
    [
        ("Z", True), ("z", True), ("+00:00", True), ("+0000", True), ("+00", True),
        ("-00:00", True), (" UTC", True), (" GMT", True), ("UTC", True), (" gmt", True),
        (" UTC+0", True), (" GMT+00:00", True), (" +00:00", True),
        ("", False), ("-04:00", False), ("+0200", False), ("+05:30", False), ("+00:30", False),
        (" UTC+2", False), (" GMT-0500", False),
    ],
)  # fmt: skip
@pytest.mark.parametrize("clock", ["T23:40", "T03:40:11.123", " 03:40:11", " 11:40 PM"])
def test_a_time_in_utc_is_said(clock: str, zone: str, is_utc: bool) -> None:
    written = WrittenDate(f"2026-05-10{clock}{zone}", "")
    calendar = calendar_of([written])
    assert calendar.days[written.text] == DAY
    assert [f"{written.text} is a time in UTC" in note for note in calendar.notes] == [
        True
    ] * is_utc


DAYS = st.lists(st.dates(date(2020, 1, 1), date(2030, 12, 31)), min_size=1, max_size=6)


@given(DAYS, st.sampled_from(["%d/%m/%Y", "%m/%d/%Y"]))
def test_slashed_dates_are_read_right_or_refused(days: list[date], form: str) -> None:
    try:
        assert read(*(day.strftime(form) for day in days)) == days
    except BadInput as refused:
        assert "nothing beside it says which" in refused.message
        assert all(day.day <= 12 for day in days)


@given(st.text(max_size=30))
def test_fuzz_any_text_is_a_date_or_refused(text: str) -> None:
    try:
        read(text)
    except BadInput as refused:
        assert "\n" not in refused.message


ODF = "urn:oasis:names:tc:opendocument:xmlns"


def opendocument(rows: str, dtd: str = "") -> bytes:
    """A spreadsheet as LibreOffice saves it, with these rows in one sheet."""
    content = (
        f'<?xml version="1.0" encoding="UTF-8"?>{dtd}'
        f'<o:document-content xmlns:o="{ODF}:office:1.0" xmlns:t="{ODF}:table:1.0"'
        f' xmlns:x="{ODF}:text:1.0"><o:body><o:spreadsheet><t:table t:name="Sheet1">{rows}'
        "</t:table></o:spreadsheet></o:body></o:document-content>"
    )
    out = BytesIO()
    with ZipFile(out, "w", ZIP_DEFLATED) as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("content.xml", content)
    return out.getvalue()


ROWS = (
    "<t:table-row><t:table-cell><x:p>tag</x:p></t:table-cell>"
    '<t:table-cell t:number-columns-repeated="2"/>'
    '<t:table-cell o:value-type="date" o:date-value="2026-05-10T00:00:00"><x:p>10.05.26</x:p>'
    "</t:table-cell></t:table-row>"
    '<t:table-row t:number-rows-repeated="2"><t:table-cell t:number-columns-repeated="1024"/>'
    "</t:table-row>"
    '<t:table-row t:number-rows-repeated="2"><t:table-cell o:value-type="float" o:value="17">'
    '<x:p>17,0</x:p></t:table-cell><t:table-cell t:number-columns-repeated="16383"/></t:table-row>'
    '<t:table-row t:number-rows-repeated="1048571">'
    '<t:table-cell t:number-columns-repeated="16384"/></t:table-row>'
)


def test_a_sheet_of_libreoffice(tmp_path: Path) -> None:
    path = tmp_path / "gala.ods"
    path.write_bytes(opendocument(ROWS))
    (sheet,) = read_sheets(path)
    assert sheet.name == "gala.ods, sheet Sheet1"
    assert [(row.number, row.cells) for row in sheet.rows] == [
        (1, ("tag", "", "", "2026-05-10")),
        (4, ("17",)),
        (5, ("17",)),
    ]
    assert sheet.real_dates == {"2026-05-10"}


FILLED = (
    '<t:table-row t:number-rows-repeated="{}"><t:table-cell t:number-columns-repeated="{}">'
    "<x:p>1</x:p></t:table-cell></t:table-row>"
)
BOMB = '<!DOCTYPE d [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'


def far_cell(row: int, column: int) -> bytes:
    book, out = Workbook(), BytesIO()
    sheet = book.worksheets[0]
    sheet.cell(1, 1, "tag")
    sheet.cell(row, column, 1)
    book.save(out)
    return out.getvalue()


def archive(**parts: bytes) -> bytes:
    out = BytesIO()
    with ZipFile(out, "w", ZIP_DEFLATED) as written:
        for name, content in parts.items():
            written.writestr(name.replace("__", "."), content)
    return out.getvalue()


def workbook_of(rows: str) -> bytes:
    """A workbook whose sheet has these rows, as XML."""
    book, out = BytesIO(far_cell(1, 2)), BytesIO()
    sheet = f'<worksheet xmlns="{MAIN}"><sheetData>{rows}</sheetData></worksheet>'
    with ZipFile(book) as given, ZipFile(out, "w", ZIP_DEFLATED) as written:
        for name in given.namelist():
            written.writestr(name, sheet if "sheet1" in name else given.read(name))
    return out.getvalue()


MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
NOTHING_THERE = "holds more than 100,000 empty rows and cells"
TOO_MUCH = "holds more than 500,000 rows, cells and values"
IN_CELLS = "its cells lie in cells"
HOSTILE = {
    "empty rows": (workbook_of("<row/>" * 3_000_000), NOTHING_THERE),
    "empty rows, spelt out": (workbook_of("<row> </row>" * 2_000_000), NOTHING_THERE),
    "empty cells": (workbook_of("<row>" + "<c/>" * 3_000_000 + "</row>"), NOTHING_THERE),
    "empty values": (workbook_of("<row><c><v/></c></row>" * 1_000_000), NOTHING_THERE),
    "filled cells": (workbook_of("<row><c><v>1</v></c></row>" * 1_000_000), TOO_MUCH),
    "nested cells": (
        workbook_of("<row>" + "<c>" * 200_000 + "</c>" * 200_000 + "</row>"),
        IN_CELLS,
    ),
    "nested text": (opendocument("<text:span>" * 200_000 + "</text:span>" * 200_000), IN_CELLS),
    "a million rows": (opendocument(FILLED.format(1_048_576, 1)), "holds more than 200,000 rows"),
    "all columns": (opendocument(FILLED.format(1000, 16384)), "holds more than 2,000,000 cells"),
    "absurd repeats": (opendocument(FILLED.format(10**18, 10**18)), "more than 2,000,000 cells"),
    "entities": (opendocument("", dtd=BOMB), "is no spreadsheet that can be read"),
    "an archive of something else": (archive(readme=b"x"), "is an archive, and holds no workbook"),
    "a great part": (archive(content__xml=bytes(80 << 20)), "holds more than 64 MB"),
    "long text": (b"1,2\n" * (5 << 20), "holds more than 16 MB of text"),
    "many lines": (b"1\n" * 300_000, "holds more than 200,000 rows"),
}


@pytest.mark.parametrize(("content", "message"), HOSTILE.values(), ids=HOSTILE)
def test_tables_without_end_are_refused_at_once(
    tmp_path: Path, content: bytes, message: str
) -> None:
    path = tmp_path / "gala.csv"
    path.write_bytes(content)
    began = time.process_time()
    with pytest.raises(BadInput, match=message):
        read_sheets(path)
    assert time.process_time() - began < 2


def test_a_formatted_sheet_is_read(tmp_path: Path) -> None:
    path = tmp_path / "gala.xlsx"
    path.write_bytes(workbook_of("<row><c><v>1</v></c></row>" + "<row><c/></row>" * 20_000))
    (sheet,) = read_sheets(path)
    assert [(row.number, row.cells) for row in sheet.rows] == [(1, ("1",))]


def test_a_cell_far_out_costs_no_time(tmp_path: Path) -> None:
    path = tmp_path / "gala.xlsx"
    path.write_bytes(far_cell(1_048_576, 16_384))
    began = time.process_time()
    (sheet,) = read_sheets(path)
    assert time.process_time() - began < 5
    assert [(row.number, len(row.cells)) for row in sheet.rows] == [(1, 1), (1_048_576, 16_384)]


FORMULAS = ["=1+1", "+1-1", "-A1", "@SUM(A1)", "=HYPERLINK(1)", "'=1", "\t=1", "\uff1d1+1"]


@pytest.mark.parametrize("name", FORMULAS)
def test_no_name_leaves_as_a_formula(name: str) -> None:
    assert csv_text([[name, -0.5, "-0.5", "A-1"]]) == f"'{name},-0.5,-0.5,A-1\n"


@given(st.text(max_size=20))
def test_names_come_back_as_they_were(name: str) -> None:
    assert as_named(as_text(name)) == name
