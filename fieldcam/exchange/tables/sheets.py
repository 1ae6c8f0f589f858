"""One sheet of cells as text, wherever it came from, and where in it each cell stands."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fieldcam.errors import BadInput
from fieldcam.foreign.bounds import MAX_ROWS


@dataclass(frozen=True, slots=True)
class SheetRow:
    """A row that is not empty."""

    number: int
    """Counted from 1, as the program shows it."""
    cells: tuple[str, ...]
    """Stripped, without the empty ones at the end."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """A CSV file, or a sheet of a workbook."""

    file: str
    title: str | None
    """Of the sheet; None for a CSV file."""
    rows: tuple[SheetRow, ...]
    real_dates: frozenset[str] = frozenset()
    """Texts of cells that the program took for dates; the others are as somebody typed them."""
    separator: str = ""
    """Between the cells of a CSV file."""

    @property
    def name(self) -> str:
        return self.file if self.title is None else f"{self.file}, sheet {self.title}"

    def row_place(self, number: int) -> str:
        """Such as "gala.csv, line 3" and "gala.xlsx, sheet May, row 3"."""
        return f"{self.name}, {'line' if self.title is None else 'row'} {number}"

    def cell_place(self, number: int, index: int, heading: str) -> str:
        """Such as "gala.csv, line 3, column fruit" and "gala.xlsx, sheet May, cell C3"."""
        if self.title is None:
            return f"{self.row_place(number)}, column {heading}"
        return f"{self.name}, cell {column_letters(index)}{number}"


def filled_rows(name: str, rows: Iterable[tuple[int, Iterable[str]]]) -> tuple[SheetRow, ...]:
    """Rows that hold something; raises BadInput where they are too many."""
    found: list[SheetRow] = []
    for number, cells in rows:
        stripped = [cell.strip() for cell in cells]
        while stripped and not stripped[-1]:
            stripped.pop()
        if not stripped:
            continue
        if len(found) == MAX_ROWS:
            raise too_large(name, f"more than {MAX_ROWS:,} rows")
        found.append(SheetRow(number, tuple(stripped)))
    return tuple(found)


def too_large(name: str, what: str) -> BadInput:
    """`what` it holds, such as "more than 5 rows"."""
    return BadInput(f"{name} holds {what}: that is no table of one block.")


def column_letters(index: int) -> str:
    """A for 0, Z for 25, AA for 26."""
    more, last = divmod(index, 26)
    return (column_letters(more - 1) if more else "") + chr(ord("A") + last)
