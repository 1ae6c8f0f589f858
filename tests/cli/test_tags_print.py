"""Printed tags are read as what they are, upright and of the size that was asked for."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from fieldcam.cli import main
from fieldcam.errors import BadInput, ExitCode
from fieldcam.report.pdf import POINTS_PER_MM, pdf_document
from fieldcam.report.tag_sheets import (
    MARGIN_MM,
    RULER_HEIGHT_MM,
    Paper,
    PaperSheet,
    Rectangle,
    SheetLayout,
    tag_sheets,
)
from fieldcam.values import TAG_SIZE_MM, Floats, ImageU8, TagPose
from fieldcam.vision.tags.detection import detect_tags

PX_PER_MM = 6
RECTANGLE = re.compile(rb"([\d.]+) ([\d.]+) ([\d.]+) ([\d.]+) re\n")


def drawn(rectangles: list[Rectangle], paper: Paper) -> ImageU8:
    """What a printer of PX_PER_MM makes of it."""
    width, height = (round(side * PX_PER_MM) for side in paper.value)
    image = np.full((height, width), 255, np.uint8)
    for box in rectangles:
        x0, x1 = box.x_mm * PX_PER_MM, (box.x_mm + box.width_mm) * PX_PER_MM
        y0, y1 = box.y_mm * PX_PER_MM, (box.y_mm + box.height_mm) * PX_PER_MM
        image[round(height - y1) : round(height - y0), round(x0) : round(x1)] = 0
    return image


def pages(document: bytes) -> list[list[Rectangle]]:
    """The rectangles of each page of a PDF."""
    streams = re.findall(rb"stream\n(.*?)\nendstream", document, re.DOTALL)
    return [[Rectangle(*map(float, found)) for found in RECTANGLE.findall(s)] for s in streams]


def sides_px(tag: TagPose) -> Floats:
    corners = np.array(tag.corners_px)
    return np.asarray(np.hypot(*(corners - np.roll(corners, 1, axis=0)).T))


@pytest.mark.parametrize(
    ("paper", "size_mm"), [(Paper.A4, TAG_SIZE_MM), (Paper.LETTER, 20.0), (Paper.A4, 100.0)]
)
def test_every_tag_of_the_file_is_read_at_its_size(paper: Paper, size_mm: float) -> None:
    layout = SheetLayout(paper, size_mm)
    count = layout.per_page + 1
    document = pdf_document(tag_sheets(40, count, layout), paper)
    found = [tag for page in pages(document) for tag in detect_tags(drawn(page, paper))]
    assert sorted(tag.id for tag in found) == list(range(40, 40 + count))
    for tag in found:
        np.testing.assert_allclose(sides_px(tag) / PX_PER_MM, size_mm, atol=0.25)
        turned = np.array(tag.corners_px) - tag.center_px
        assert [(x > 0, y > 0) for x, y in turned] == [
            (False, True), (True, True), (True, False), (False, False)
        ]  # fmt: skip


def test_numbers_stand_under_their_tags() -> None:
    layout = SheetLayout(Paper.A4, TAG_SIZE_MM)
    (sheet,) = tag_sheets(7, 3, layout)
    image = drawn(list(sheet.rectangles), Paper.A4)
    labels = {line.text: line for line in sheet.texts if line.height_mm == 4.0}
    tags = detect_tags(image)
    assert {tag.id for tag in tags} == {7, 8, 9}
    for tag in tags:
        label = labels[str(tag.id)]
        x_mm, from_top_mm = (np.array(tag.center_px) + 0.5) / PX_PER_MM
        below_mm = (Paper.A4.value[1] - from_top_mm) - label.y_mm
        assert label.x_mm == pytest.approx(x_mm, abs=2)
        assert TAG_SIZE_MM / 2 < below_mm - label.height_mm < TAG_SIZE_MM


def test_all_lies_within_the_margins_and_white_surrounds_each_tag() -> None:
    for paper, size_mm in ((Paper.A4, TAG_SIZE_MM), (Paper.LETTER, 5.0), (Paper.LETTER, 127.0)):
        layout = SheetLayout(paper, size_mm)
        columns, _ = layout.grid
        for place in range(layout.per_page):
            x_mm, y_mm = layout.corner_mm(place)
            assert x_mm >= MARGIN_MM and y_mm >= MARGIN_MM + RULER_HEIGHT_MM - 1e-9
            assert x_mm + layout.card_mm[0] <= paper.value[0] - MARGIN_MM + 1e-9
        assert columns >= 1
        assert layout.card_mm[0] == pytest.approx(size_mm * 12 / 8)


def test_the_ruler_is_100_mm_long() -> None:
    (sheet,) = tag_sheets(0, 1, SheetLayout(Paper.LETTER, TAG_SIZE_MM))
    low = [box for box in sheet.rectangles if box.y_mm < MARGIN_MM + RULER_HEIGHT_MM / 2]
    ticks = sorted(box.x_mm + box.width_mm / 2 for box in low if box.width_mm < 1)
    np.testing.assert_allclose(ticks, MARGIN_MM + np.arange(101))
    (line,) = [box for box in low if box.width_mm >= 1]
    assert (line.x_mm, line.width_mm) == (MARGIN_MM, 100)
    shown = {text.text for text in sheet.texts}
    assert {"0", "50", "100"} <= shown


@pytest.mark.parametrize("paper", list(Paper))
def test_the_file_is_a_pdf_whose_table_is_right(paper: Paper) -> None:
    layout = SheetLayout(paper, TAG_SIZE_MM)
    document = pdf_document(tag_sheets(0, 2 * layout.per_page + 1, layout), paper)
    assert document.startswith(b"%PDF-1.4\n") and document.endswith(b"%%EOF\n")
    assert document.count(b"/Type /Page ") == 3 and b"/Count 3 " in document
    assert b"/PrintScaling /None" in document
    boxes = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", document)
    assert len(boxes) == 3
    for box in boxes:
        np.testing.assert_allclose([float(v) / POINTS_PER_MM for v in box], paper.value, atol=1e-3)
    table = int(document.split(b"startxref\n")[1].split()[0])
    lines = document[table:].split(b"\n")
    assert lines[0] == b"xref"
    size = int(lines[1].split()[1])
    for number, line in enumerate(lines[3 : 2 + size], 1):
        assert len(line) == 19 and line.endswith(b" 00000 n ")
        assert document[int(line[:10]) :].startswith(b"%d 0 obj\n" % number)
    for length, stream in re.findall(
        rb"/Length (\d+) >>\nstream\n(.*?)\nendstream", document, re.DOTALL
    ):
        assert int(length) == len(stream)


@pytest.mark.parametrize(("cards", "crosses"), [(1, 4), (3, 8), (4, 10), (5, 12), (12, 20)])
def test_crosses_stand_at_cards_only(cards: int, crosses: int) -> None:
    layout = SheetLayout(Paper.A4, TAG_SIZE_MM)
    assert layout.grid[0] == 4
    (sheet,) = tag_sheets(0, cards, layout)
    middles = {
        (round(box.x_mm + box.width_mm / 2, 3), round(box.y_mm + box.height_mm / 2, 3))
        for box in sheet.rectangles
        if 3.0 in (box.width_mm, box.height_mm)
    }
    width, height = layout.card_mm
    corners = {
        (round(x_mm + across * width, 3), round(y_mm + up * height, 3))
        for x_mm, y_mm in map(layout.corner_mm, range(cards))
        for across in (0, 1)
        for up in (0, 1)
    }
    assert middles == corners and len(middles) == crosses


def test_text_cannot_break_out_of_its_string() -> None:
    from fieldcam.report.tag_sheets import Text

    sheet = PaperSheet((), (Text(1, 1, 3, "a) Tj (b\\"),))
    assert rb"(a\) Tj \(b\\) Tj ET" in pdf_document([sheet], Paper.A4)


@pytest.mark.parametrize("size_mm", [1.0, 4.9, 150.0, 1e9])
def test_a_size_that_no_paper_takes_is_refused(size_mm: float) -> None:
    with pytest.raises(BadInput, match="cannot be printed"):
        tag_sheets(0, 1, SheetLayout(Paper.A4, size_mm))


def test_the_command_says_what_it_wrote(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "tags.pdf"
    options = ["--first", "17", "--count", "25", "--paper", "letter"]
    assert main(["tags-print", str(out), *options, "--json"]) == ExitCode.OK
    said = json.loads(capsys.readouterr().out)
    assert said == {
        "file": str(out),
        "first": 17,
        "last": 41,
        "tag_size_mm": TAG_SIZE_MM,
        "paper": "letter",
        "pages": 2,
        "tags_per_page": 20,
    }
    assert out.read_bytes().startswith(b"%PDF-1.4")
    assert main(["tags-print", str(out)]) == ExitCode.OK
    assert "tags 0 to 69" in capsys.readouterr().out


@pytest.mark.parametrize(
    "argv",
    [
        [],
        ["out.png"],
        ["nowhere/out.pdf"],
        ["out.pdf", "--first", "587"],
        ["out.pdf", "--first", "580", "--count", "8"],
        ["out.pdf", "--count", "0"],
        ["out.pdf", "--tag-size-mm", "-3"],
        ["out.pdf", "--tag-size-mm", "300"],
        ["out.pdf", "--paper", "a9"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_one_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    argv: list[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["tags-print", *argv]) == ExitCode.BAD_INPUT
    out, err = capsys.readouterr()
    assert out == "" and len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
