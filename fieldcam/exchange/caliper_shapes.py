"""Sizes out of the shapes that caliper tables have: long, wide, the peers', the authors'."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import date

from fieldcam.errors import BadInput
from fieldcam.exchange.caliper_cells import day_of, diameter_of, is_day, label_of, whole_of
from fieldcam.exchange.caliper_sizes import CaliperSize
from fieldcam.exchange.caliper_tables import Table, TableRow
from fieldcam.growth.records import Presence, Source, fruit_name
from fieldcam.words import number_of

CLUSTER = ("cluster", "tag", "tag_id")
FRUIT = ("fruit", "fruitlet", "fruit_id")
DIAMETER = ("diameter_mm", "diameter", "diam_mm", "diam", "size_mm")
_IN_CM = ("diameter_cm", "diam_cm", "size_cm")
DIAM, STATE, MEASURED_BY = "diam.", "state.", "measured_by"
_WIDE = re.compile(r"diam(?:eter)?(?:_mm)?[._]?(.+)")
_OF_AUTHORS = re.compile(r"fl[._]?\d+")
_SHAPES = (
    "Known are date,cluster,fruit,diameter_mm; tree,cluster,fruit,diam.2026-05-21 and so on;"
    " the same with diam.1 and so on and --dates."
)
Sizes = Iterator[CaliperSize]


def long_or_wide(table: Table, dates: Sequence[date]) -> Sizes:
    """Sizes of a CSV table; `dates` are those of numbered visits.

    Raises BadInput for a heading that is none of these shapes, and for each bad cell.
    """
    _refuse_centimetres(table)
    visits = _visit_columns(table)
    if "date" in table.columns and _column(table, DIAMETER) is not None:
        _refuse_dates(table, dates)
        return _long(table)
    if not visits:
        raise BadInput(f"{table.name}: its heading is not that of a caliper table.", _SHAPES)
    if all(visit.isdigit() for visit in visits):
        return _wide(table, _numbered(table, visits, dates))
    _refuse_dates(table, dates)
    return _wide(table, _dated(table, visits))


def of_authors(table: Table) -> Sizes:
    """Sizes of a sheet that is named as its date, with the columns tag, fl1 ... flN."""
    day = day_of(table.sheet, table.name)
    fruits = {name: fruit_name(name) for name in table.columns if _OF_AUTHORS.fullmatch(name)}
    cluster = _column(table, CLUSTER)
    if cluster is None or not fruits:
        raise BadInput(f"{table.name}: it needs the columns tag, fl1, fl2 and so on.")
    places: dict[int, str] = {}
    for row in table.rows:
        tag = whole_of(row.cells[cluster], row.place, "tag")
        if tag in places:
            raise BadInput(f"{row.place}: tag {tag} is in {places[tag]} already.")
        places[tag] = row.place.rpartition(", ")[2]
        for column, fruit in fruits.items():
            yield _size(row, column, tag, fruit, day)


def _long(table: Table) -> Sizes:
    diameter, cluster = _needed(table, DIAMETER), _needed(table, CLUSTER)
    fruit = _column(table, FRUIT)
    for row in table.rows:
        tag = whole_of(row.cells[cluster], row.place, "cluster")
        name = fruit_name(row.cells[fruit]) if fruit else ""
        yield _size(row, diameter, tag, name, day_of(row.cells["date"], row.cell_places["date"]))


def _wide(table: Table, days: Mapping[str, date]) -> Sizes:
    cluster, fruit = _needed(table, CLUSTER), _needed(table, FRUIT)
    states = {
        day_of(name.removeprefix(STATE), table.name): name
        for name in table.columns
        if name.startswith(STATE)
    }
    for row in table.rows:
        tag = whole_of(row.cells[cluster], row.place, "cluster")
        name = fruit_name(row.cells[fruit])
        if not name:
            raise BadInput(f"{row.place}: the fruit has no name.")
        for column, day in days.items():
            if not states or row.cells.get(states.get(day, ""), ""):
                yield _size(row, column, tag, name, day, states.get(day))


def _size(
    row: TableRow, column: str, cluster: int, fruit: str, day: date, state: str | None = None
) -> CaliperSize:
    written = row.cells[column]
    diameter_mm = diameter_of(written, row.cell_places[column])
    presence = None
    if state is not None:
        presence = _presence(row.cells[state], diameter_mm, row.cell_places[state])
    tree = label_of(row.cells.get("tree", ""))
    by_camera = row.cells.get(MEASURED_BY, "") == Source.CAMERA
    source = Source.CAMERA if by_camera else Source.CALIPERS
    return CaliperSize(
        row.cell_places[column], tree, cluster, fruit, day, written, diameter_mm, presence, source
    )


def _presence(text: str, diameter_mm: float | None, place: str) -> Presence:
    if text not in list(Presence):
        raise BadInput(f"{place}: {text!r} is none of {', '.join(Presence)}.")
    if (text == Presence.SIZED) != (diameter_mm is not None):
        raise BadInput(f"{place}: a fruit has a size exactly where it is {Presence.SIZED}.")
    return Presence(text)


def _visit_columns(table: Table) -> dict[str, str]:
    """Columns of sizes by what tells their visit: a date, or a number."""
    found = {}
    for name in table.columns:
        told = _WIDE.fullmatch(name)
        visit = told[1] if told else name
        if is_day(visit) or (told and visit.isdigit()):
            found[visit] = name
    return found


def _dated(table: Table, visits: Mapping[str, str]) -> dict[str, date]:
    days: dict[str, date] = {}
    for visit, column in visits.items():
        if visit.isdigit():
            raise BadInput(f"{table.name}: column {column} has a number, others have a date.")
        day = day_of(visit, f"{table.name}, column {column}")
        if day in days.values():
            raise BadInput(f"{table.name}: there are two columns for {day}.")
        days[column] = day
    return days


def _numbered(table: Table, visits: Mapping[str, str], dates: Sequence[date]) -> dict[str, date]:
    columns = [visits[number] for number in sorted(visits, key=int)]
    used = [column for column in columns if any(row.cells[column] for row in table.rows)]
    if not dates:
        raise BadInput(
            f"{table.name} numbers its visits ({', '.join(columns)}), but their dates are missing.",
            "Name them with --dates 2026-05-21,2026-05-25 and so on.",
        )
    if list(dates) != sorted(set(dates)):
        raise BadInput(f"The dates {', '.join(map(str, dates))} are not in order.")
    if len(dates) not in (len(used), len(columns)):
        raise BadInput(
            f"{table.name} has sizes of {number_of(len(used), 'visit')}, but --dates names"
            f" {len(dates)}."
        )
    named = columns if len(dates) == len(columns) else used
    return dict(zip(named, dates, strict=True))


def _refuse_dates(table: Table, dates: Sequence[date]) -> None:
    if dates:
        raise BadInput(f"{table.name} names its own dates.", "Leave out --dates.")


def _refuse_centimetres(table: Table) -> None:
    if found := next((name for name in table.columns if name in _IN_CM), None):
        raise BadInput(
            f"{table.name}: column {found} seems to be in centimetres; is it?",
            "fieldcam needs millimetres, in a column diameter_mm.",
        )


def _column(table: Table, names: Sequence[str]) -> str | None:
    return next((name for name in names if name in table.columns), None)


def _needed(table: Table, names: Sequence[str]) -> str:
    found = _column(table, names)
    if found is None:
        raise BadInput(f"{table.name}: the column {names[0]} is missing.", _SHAPES)
    return found
