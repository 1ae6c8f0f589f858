"""Sheets of numbered tags at true size: where each black rectangle and each number lies.

Everything is in millimetres from the lower left corner of the paper. Cards lie in
rows, the lowest number at the upper left; small crosses say where to cut.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import product

from fieldcam.errors import BadInput
from fieldcam.report.black_runs import runs_of
from fieldcam.vision.tags.pattern import CELLS, tag_cells

MARGIN_MM = 10.0
"""No printer reaches the paper's edge."""
QUIET_CELLS = 2
"""White around a tag; the detector needs one cell."""
LABEL_MM = 4.0
RULER_MM = 100
RULER_HEIGHT_MM = 18.0
LINE_MM = 0.15
SMALLEST_TAG_MM = 5.0


class Paper(Enum):
    """Width and height, mm."""

    A4 = (210.0, 297.0)
    LETTER = (215.9, 279.4)


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A black one; x and y of its lower left corner."""

    x_mm: float
    y_mm: float
    width_mm: float
    height_mm: float


@dataclass(frozen=True, slots=True)
class Text:
    """A line of text; x and y of its base line's start."""

    x_mm: float
    y_mm: float
    height_mm: float
    """Of the font."""
    text: str


@dataclass(frozen=True, slots=True)
class PaperSheet:
    """One page."""

    rectangles: tuple[Rectangle, ...]
    texts: tuple[Text, ...]


@dataclass(frozen=True, slots=True)
class SheetLayout:
    """How cards of one tag size share a paper."""

    paper: Paper
    tag_size_mm: float

    @property
    def cell_mm(self) -> float:
        return self.tag_size_mm / CELLS

    @property
    def card_mm(self) -> tuple[float, float]:
        """Width and height of a card: the tag, its quiet zone and the number below."""
        side = self.tag_size_mm + 2 * QUIET_CELLS * self.cell_mm
        return side, side + LABEL_MM

    @property
    def grid(self) -> tuple[int, int]:
        """Columns and rows of cards."""
        width, height = (side - 2 * MARGIN_MM for side in self.paper.value)
        card_width, card_height = self.card_mm
        return int(width // card_width), int((height - RULER_HEIGHT_MM) // card_height)

    @property
    def per_page(self) -> int:
        columns, rows = self.grid
        return columns * rows

    def corner_mm(self, place: int) -> tuple[float, float]:
        """Lower left corner of the card at this place of a page."""
        row, column = divmod(place, self.grid[0])
        width, height = self.card_mm
        return MARGIN_MM + column * width, self.paper.value[1] - MARGIN_MM - (row + 1) * height


def tag_sheets(first: int, count: int, layout: SheetLayout) -> tuple[PaperSheet, ...]:
    """As many pages as it takes."""
    if layout.tag_size_mm < SMALLEST_TAG_MM or not layout.per_page:
        raise BadInput(
            f"Tags of {layout.tag_size_mm:g} mm cannot be printed on {layout.paper.name.lower()}.",
            f"Choose a size from {SMALLEST_TAG_MM:g} mm to what the paper is wide enough for.",
        )
    ids = range(first, first + count)
    steps = range(0, count, layout.per_page)
    return tuple(_sheet(ids[step : step + layout.per_page], layout) for step in steps)


def _sheet(ids: range, layout: SheetLayout) -> PaperSheet:
    rectangles = [*_cut_marks(len(ids), layout), *ruler()]
    texts = [_title(ids, layout), *ruler_texts()]
    for place, tag_id in enumerate(ids):
        x_mm, y_mm = layout.corner_mm(place)
        rectangles += _tag(tag_id, x_mm, y_mm + LABEL_MM, layout.cell_mm)
        middle_mm = x_mm + layout.card_mm[0] / 2
        texts.append(_centred(middle_mm, y_mm + 1.5, LABEL_MM, str(tag_id)))
    return PaperSheet(tuple(rectangles), tuple(texts))


def _tag(tag_id: int, x_mm: float, y_mm: float, cell_mm: float) -> Iterator[Rectangle]:
    """Upright, as the detector understands it."""
    for row, start, length in runs_of(tag_cells(tag_id)):
        yield Rectangle(
            x_mm + (QUIET_CELLS + start) * cell_mm,
            y_mm + (QUIET_CELLS + CELLS - 1 - row) * cell_mm,
            length * cell_mm,
            cell_mm,
        )


def _cut_marks(cards: int, layout: SheetLayout, arm_mm: float = 1.5) -> Iterator[Rectangle]:
    """A cross at every corner of a card, once where cards share it."""
    columns, _ = layout.grid
    width, height = layout.card_mm
    corners = {
        (column + right, row + below)
        for row, column in (divmod(place, columns) for place in range(cards))
        for right, below in product((0, 1), (0, 1))
    }
    left_mm, bottom_mm = layout.corner_mm(0)
    for column, row in sorted(corners):
        x_mm, y_mm = left_mm + column * width, bottom_mm + (1 - row) * height
        yield Rectangle(x_mm - arm_mm, y_mm - LINE_MM / 2, 2 * arm_mm, LINE_MM)
        yield Rectangle(x_mm - LINE_MM / 2, y_mm - arm_mm, LINE_MM, 2 * arm_mm)


def ruler() -> Iterator[Rectangle]:
    """Its lines' middles are at whole millimetres."""
    yield Rectangle(MARGIN_MM, MARGIN_MM + 5, RULER_MM, LINE_MM)
    for mm in range(RULER_MM + 1):
        height_mm = 5.0 if mm % 10 == 0 else 3.5 if mm % 5 == 0 else 2.0
        yield Rectangle(MARGIN_MM + mm - LINE_MM / 2, MARGIN_MM + 5, LINE_MM, height_mm)


def ruler_texts() -> Iterator[Text]:
    """The numbers below it."""
    for mm in range(0, RULER_MM + 1, 10):
        yield _centred(MARGIN_MM + mm, MARGIN_MM + 2, 2.5, str(mm))


def _title(ids: range, layout: SheetLayout) -> Text:
    text = (
        f"tag36h11 {ids[0]} to {ids[-1]}, black square {layout.tag_size_mm:g} mm."
        " Print at 100 %: this ruler must be 100 mm long."
    )
    return Text(MARGIN_MM, MARGIN_MM - 1.5, 3.0, text)


def _centred(x_mm: float, y_mm: float, height_mm: float, digits: str) -> Text:
    """Helvetica's digits are all 0.556 of its height wide."""
    return Text(x_mm - 0.278 * height_mm * len(digits), y_mm, height_mm, digits)
