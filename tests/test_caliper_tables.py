"""Caliper tables: every shape in use is read, and what is wrong is named with its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from fieldcam.exchange.calipers import CaliperTable, read_calipers, wide_table
from fieldcam.growth.forecast import forecast
from fieldcam.growth.records import BlockRecord, Presence, Source
from fieldcam.growth.visits import chosen_interval, visits_of
from fieldcam.simulator.plan import Block

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
    "long with numbers of spreadsheets": LONG.replace(",17,", ",17.0,").replace(",1,", ",1.0,"),
}


@pytest.mark.parametrize("text", GOOD.values(), ids=GOOD)
def test_what_spreadsheets_write_is_read(tmp_path: Path, text: str | bytes) -> None:
    record = read(tmp_path, text).record
    assert sizes(record) == EXPECTED
    assert (record.name, record.source, record.visits) == (
        "gala",
        Source.CALIPERS,
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
    book.remove(book.active)
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
        "Sheets that are not named as a date were left out: notes.",
        "Sheets without rows were left out: 2026-05-18.",
    )


def test_the_authors_workbook(tmp_path: Path) -> None:
    found = read_calipers(workbook(tmp_path / "gala.xlsx", {**SHEETS, "notes": [("rain",)]}))
    assert sizes(found.record) == EXPECTED
    assert "Sheets that are not named as a date were left out: notes." in found.notes


def test_a_fruit_of_the_authors_has_one_name_in_all_shapes(tmp_path: Path) -> None:
    rows = "cluster,fruit,diam.2026-05-10\n17,fl1,8.5\n17,FL 02,7\n17,3.0,9\n17,king,9.5\n"
    assert {fruit for _, fruit in sizes(read(tmp_path, rows).record)} == {"1", "2", "3", "king"}


BAD_SHEETS: dict[str, tuple[dict[str, list[tuple[object, ...]]], str]] = {
    "no dates": ({"may": [HEADING]}, "No sheet of gala.xlsx is named as a date"),
    "no fruit": ({"2026-05-10": [("tag", "a")]}, "gala.xlsx, sheet 2026-05-10: it needs"),
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


@pytest.mark.parametrize("content", [b"", b"no workbook", b"PK\x03\x04"])
def test_files_that_are_no_workbooks(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "gala.xlsx"
    path.write_bytes(content)
    with pytest.raises(BadInput, match="is no workbook"):
        read_calipers(path)
    named_wrongly = path.with_suffix(".csv")
    workbook(path, SHEETS).rename(named_wrongly)
    with pytest.raises(BadInput, match=r"is a workbook, not a CSV table\. Let its name end in"):
        read_calipers(named_wrongly)
    with pytest.raises(BadInput, match="There is no file"):
        read_calipers(path)


BAD = {
    "": "gala.csv is empty.",
    "\n\n": "gala.csv is empty.",
    "a,b,c\n1,2,3\n": "gala.csv: its heading is not that of a caliper table.",
    "date,fruit,diameter_mm\n": "gala.csv: the column cluster is missing.",
    "date,cluster,fruit,diameter_mm\n": "gala.csv holds no sizes.",
    WIDE.replace("8.5", "8,5"): "gala.csv, line 2: there are 6 cells below 5 headings; are commas",
    WIDE.replace("8.5", "big"): "gala.csv, line 2, column diam.2026-05-10: 'big' is no diameter",
    WIDE.replace("8.5", "-8.5"): "gala.csv, line 2, column diam.2026-05-10: -8.5 mm is no",
    WIDE.replace("8.5", "0"): "gala.csv, line 2, column diam.2026-05-10: 0 mm is no diameter.",
    WIDE.replace("8.5", "850"): "gala.csv, line 2, column diam.2026-05-10: 850 mm is no size",
    WIDE.replace("8.5", "1e1"): "gala.csv, line 2, column diam.2026-05-10: '1e1' is no diameter",
    WIDE.replace("2026-05-14", "2026-05-10 "): "gala.csv, line 1: there are two columns",
    WIDE.replace("2026-05-14", "2026.05.10"): "gala.csv: there are two columns for 2026-05-10.",
    WIDE.replace(
        "2026-05-14", "2026-02-30"
    ): "gala.csv, column diam.2026-02-30: '2026-02-30' is no",
    WIDE.replace(
        "2026-05-14", "05/06/2026"
    ): "gala.csv, column diam.05/06/2026: '05/06/2026' is no",
    WIDE.replace("1,17,2", "1,17,1"): "gala.csv, line 3, column diam.2026-05-10: fruit 1 of cluster"
    " 17 on 2026-05-10 is in line 2, column diam.2026-05-10 already.",
    WIDE.replace("1,17,2", "2,17,2"): "gala.csv, line 3, column diam.2026-05-10: cluster 17 is on"
    " tree 2, but on tree 1 in line 2",
    WIDE.replace("1,17,2", "1,,2"): "gala.csv, line 3: the cluster is missing.",
    WIDE.replace("1,17,2", "1,A,2"): "gala.csv, line 3: 'A' is no cluster number.",
    WIDE.replace("1,17,2", "1,17,"): "gala.csv, line 3: the fruit has no name.",
    WIDE.replace("diam.2026-05-10", "diam.1"): "gala.csv: column diam.1 has a number, others",
    WIDE.replace("2026-05-10", "1").replace("2026-05-14", "2"): "gala.csv numbers its visits",
    LONG.replace("diameter_mm", "diameter_cm"): "gala.csv: column diameter_cm seems to be in cent",
    LONG.replace("2026-05-14,17,1", "2026-05-14,17,"): "gala.csv, line 5, column diameter_mm: this",
    LONG.replace("2026-05-14,17,1", "14/5/26,17,1"): "gala.csv, line 5, column date: '14/5/26' is",
    "date,cluster,fruit,diameter_mm\n2026-05-10,17,1,0.85\n2026-05-10,17,2,1.2\n": "gala.csv: the"
    " sizes of 2026-05-10 are 1 in the middle; are they in centimetres?",
    WIDE.replace("8.5", "2.9").replace("7.0", "2.6").replace("9.1", "3.0"): "gala.csv: the sizes of"
    " 2026-05-10 are 2.9 in the middle; are they in centimetres?",
    WIDE.replace("11.0", "1.1").replace("12.0", "1.2"): "gala.csv: the sizes of 2026-05-14 are 1.1",
}


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
        "gala.csv says NA or the like in 1",
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
    record = measured_block(Block.plan(seed, 20), Measuring(Source.CAMERA, (0, 3, 7)), seed)
    found = read(tmp_path, wide_table(record))
    again = found.record
    assert again.source is Source.CAMERA
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
    assert read(tmp_path, mixed.replace(",camera", ",Ana")).record.source is Source.CALIPERS


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
