"""A sheet with one calibration board at true size, and a ruler to prove it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fieldcam.calibration.boards import SQUARE_CELLS, Board, Kind
from fieldcam.errors import BadInput
from fieldcam.report.black_runs import runs_of
from fieldcam.report.tag_sheets import (
    MARGIN_MM,
    RULER_HEIGHT_MM,
    Paper,
    PaperSheet,
    Rectangle,
    Text,
    ruler,
    ruler_texts,
)
from fieldcam.values import ImageU8

TEXT_MM = 3.0


def board_sheet(board: Board, paper: Paper) -> PaperSheet:
    """The board in the middle of the paper, turned by a quarter where it fits only so."""
    cells, cell_mm = _cells(board)
    free_mm = paper.value[0] - 2 * MARGIN_MM, paper.value[1] - 2 * MARGIN_MM - RULER_HEIGHT_MM
    turns = [turned for turned in (cells, np.rot90(cells)) if _fits(turned, cell_mm, free_mm)]
    if not turns:
        raise BadInput(
            f"A board of {board.columns} x {board.rows} squares of {board.square_mm:g} mm"
            f" does not fit on {paper.name.lower()}.",
            "Choose fewer or smaller squares.",
        )
    return PaperSheet(
        tuple([*_placed(turns[0], cell_mm, paper), *ruler()]), (_title(board), *ruler_texts())
    )


def _cells(board: Board) -> tuple[ImageU8, float]:
    """0 where it is black, upper row first, and the side of a cell."""
    if board.kind is Kind.CHECKERBOARD:
        odd = np.add.outer(np.arange(board.rows), np.arange(board.columns)) % 2
        return (odd * 255).astype(np.uint8), board.square_mm
    size = board.columns * SQUARE_CELLS, board.rows * SQUARE_CELLS
    drawn = board.charuco.generateImage(size, marginSize=0, borderBits=1)
    return np.asarray(drawn, np.uint8), board.square_mm / SQUARE_CELLS


def _fits(cells: ImageU8, cell_mm: float, free_mm: tuple[float, float]) -> bool:
    rows, columns = cells.shape
    return bool(columns * cell_mm <= free_mm[0] and rows * cell_mm <= free_mm[1])


def _placed(cells: ImageU8, cell_mm: float, paper: Paper) -> Iterator[Rectangle]:
    rows, columns = cells.shape
    width_mm, height_mm = paper.value
    x0_mm = (width_mm - columns * cell_mm) / 2
    above_mm = (height_mm + RULER_HEIGHT_MM + rows * cell_mm) / 2
    for row, start, length in runs_of(cells):
        y_mm = above_mm - (row + 1) * cell_mm
        yield Rectangle(x0_mm + start * cell_mm, y_mm, length * cell_mm, cell_mm)


def _title(board: Board) -> Text:
    text = (
        f"{board.kind} {board.columns}x{board.rows}, squares {board.square_mm:g} mm."
        " Print at 100 %: this ruler must be 100 mm long."
    )
    return Text(MARGIN_MM, MARGIN_MM - 1.5, TEXT_MM, text)
