"""The planned route as a table: what spreadsheets write is read, what is wrong is named."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from openpyxl import Workbook

from fieldcam.errors import BadInput
from fieldcam.exchange.route_table import PlannedStop, read_route

EXPECTED = (PlannedStop("1", 10), PlannedStop("1", 11), PlannedStop("2", 20))
GOOD = {
    "plain": b"tree,tag\n1,10\n1,11\n2,20\n",
    "semicolons, other case, no last newline": b"Tag ; TREE\n10;1\n11;1\n20;2",
    "tabs and Windows": b"tree\ttag\r\n1\t10\r\n1\t11\r\n2\t20\r\n",
    "byte order mark": b"\xef\xbb\xbftree,tag\n1,10\n1,11\n2,20\n",
    "other columns": b"row,tree,variety,tag\na,1,Gala,10\na,1,Gala,11\nb,2,Gala,20\n",
    "trees only where they change": b"tree,tag\n1,10\n,11\n2,20\n",
    "empty lines and rows": b"\n\ntree,tag\n\n1,10\n,\n1,11\n2,20\n\n",
    "decimals and quotes": b'tree,tag\n"1",10.0\n"1","11.0"\n2,20\n',
    "no heading": b"1,10\n1,11\n2,20\n",
    "a line that says the separator": b"sep=;\r\ntree;tag\r\n1;10\r\n1;11\r\n2;20\r\n",
    "a title": b"Gala, block 7;;\n\nTree;Tag;Note\n1;10;by the road, left\n1;11;\n2;20;\n",
    "UTF-16, as Excel calls Unicode": "tree\ttag\n1\t10\n1\t11\n2\t20\n".encode("utf-16"),
    "numbers of a spreadsheet": b"Tree No.,Tag ID\n1.0,10.0\n1.0,11.0\n2.0,20.0\n",
    "rows of trees with names of their own": b"row,tree,tag\n1,1,10\n1,1,11\n2,2,20\n",
}


@pytest.mark.parametrize("content", GOOD.values(), ids=GOOD)
def test_what_spreadsheets_write_is_read(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "route.csv"
    path.write_bytes(content)
    assert read_route(path).stops == EXPECTED


@pytest.mark.parametrize("name", ["route.xlsx", "route.csv"])
def test_a_workbook_is_read_whatever_its_name(tmp_path: Path, name: str) -> None:
    book = Workbook()
    sheet = book.worksheets[0]
    sheet.title = "Sheet1"
    for row in (("Gala, block 7", None), ("tree", "tag"), (1, 10), (None, 11), (2, 20)):
        sheet.append(row)
    book.save(tmp_path / name)
    assert read_route(tmp_path / name).stops == EXPECTED


def test_trees_numbered_anew_in_each_row_are_not_merged(tmp_path: Path) -> None:
    path = tmp_path / "route.csv"
    path.write_text("row,tree,tag\n1,1,17\n1,2,18\n2,1,19\n,2,20\n")
    found = read_route(path)
    assert [stop.tree for stop in found.stops] == ["1-1", "1-2", "2-1", "2-2"]
    assert found.notes[-1] == (
        "Trees are numbered anew in each row: tree 1 of row 1 is called 1-1."
    )


BAD = {
    b"row,tree,tag\n1,1,17\n2,1,18\n3,2,19\n": "route.csv, line 3: the column row differs in each"
    " line; it may count the lines, or tree 1 is another tree in each row.",
    b"tree,tag\n1,17\n2,18\n1,19\n2,20\n": "route.csv, line 4: tree 1 comes again after tree 2. It"
    " may be the same tree, or another one where trees are numbered anew in each row.",
    b"": "route.csv is empty. It needs the columns tree and tag",
    b"tree,tag\n": "route.csv holds no tags. It needs",
    b"a,b,c\n1,2,3\n": "route.csv has no heading of a route; it begins with 'a b c'.",
    b"tree,tag\n1,10\n1,ten\n": "route.csv, line 3: 'ten' is no tag number.",
    b"tree,tag\n1,10\n\n1\n": "route.csv, line 4: the tag is missing.",
    b"tree,tag\n,10\n": "route.csv, line 2: the tree is missing.",
    b"tree,tag\n1,10\n2,10\n": "route.csv, line 3: tag 10 is in line 2 already.",
    b"tree,tag\n1,587\n": "route.csv, line 2: there is no tag 587: they end at 586.",
    b"tree,tag\n1,-3\n": "route.csv, line 2: '-3' is no tag number.",
    b"tree,tag\n1,1.5\n": "route.csv, line 2: '1.5' is no tag number.",
    b"tree,tag\n\xff\xfe,1\n": "route.csv is no text in UTF-8. Save it as CSV (UTF-8).",
}


@pytest.mark.parametrize("content", BAD)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "route.csv"
    path.write_bytes(content)
    with pytest.raises(BadInput) as found:
        read_route(path)
    assert str(found.value).startswith(BAD[content])


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.csv", tmp_path):
        with pytest.raises(BadInput):
            read_route(path)


@given(content=st.binary(max_size=300))
def test_fuzz_any_file_is_a_route_or_one_sentence(
    content: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "route.csv"
    path.write_bytes(b"tree,tag\n" + content)
    try:
        assert read_route(path).stops
    except BadInput as error:
        assert str(error).count("\n") == 0
