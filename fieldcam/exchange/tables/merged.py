"""Cells that somebody merged, or wrote once for the lines below: an empty one repeats them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from fieldcam.exchange.tables.headings import Table, TableRow


@dataclass(frozen=True, slots=True)
class Repeated:
    """Columns whose empty cells take what stands above."""

    whole: Sequence[str]
    """From the widest to the narrowest: within a new tree no cluster goes on."""
    alone: Sequence[str] = ()
    """Whatever the others say."""
    last: str | None = None
    """Repeated only where the narrowest of `whole` is, on another of `alone`: a fruit."""


def filled_down(table: Table, repeated: Repeated) -> tuple[list[TableRow], str]:
    """The rows with their empty cells filled, and a note where there were any."""
    rows = list(_filled(table.rows, repeated))
    pairs = zip(table.rows, rows, strict=True)
    changed = [(old, new) for old, new in pairs if old.cells != new.cells]
    if not changed:
        return rows, ""
    old, new = changed[0]
    columns = [name for name in new.cells if old.cells[name] != new.cells[name]]
    return rows, (
        f"Empty cells below a {' or a '.join(columns)} repeat it, as in merged cells; the first is"
        f" in {old.place}."
    )


def _filled(rows: Sequence[TableRow], repeated: Repeated) -> Iterator[TableRow]:
    above: dict[str, str] = {}
    for row in rows:
        taken = dict(_taken(row.cells, above, repeated)) if above else {}
        filled = replace(row, cells=row.cells | taken) if taken else row
        yield filled
        above = filled.cells


def _taken(
    cells: dict[str, str], above: dict[str, str], repeated: Repeated
) -> Iterator[tuple[str, str]]:
    """What empty cells take from the line above."""
    for name in repeated.alone:
        if not cells[name] and above[name]:
            yield name, above[name]
    for name in repeated.whole:
        if cells[name] and cells[name] != above[name]:
            return
        if not cells[name] and above[name]:
            yield name, above[name]
    if repeated.last is None or cells[repeated.last] or not repeated.whole:
        return
    elsewhen = any(cells[name] and cells[name] != above[name] for name in repeated.alone)
    if elsewhen and not cells[repeated.whole[-1]] and above[repeated.last]:
        yield repeated.last, above[repeated.last]
