"""By which headings the columns of a caliper table are known."""

from __future__ import annotations

import re
from collections.abc import Sequence

from fieldcam.errors import BadInput
from fieldcam.exchange.tables.dates import is_day
from fieldcam.exchange.tables.headings import UNITS, Table, find_table
from fieldcam.exchange.tables.sheets import Sheet

CLUSTER = ("cluster", "tag", "tag_id", "cluster_id", "spur", "spur_id")
FRUIT = ("fruit", "fruitlet", "fruit_id", "fruitlet_id")
DATE = ("date", "day", "visit_date", "measurement_date", "date_measured", "timestamp")
DIAMETER = ("diameter_mm", "diameter", "diam_mm", "diam", "size_mm", "size")
DIAM, STATE, CERTAINTY, MEASURED_BY, DOUBT = "diam.", "state.", "sure.", "measured_by", "doubt"
_WIDE = re.compile(r"(?:diam(?:eter)?|size|visit_?\d*)(?:_mm)?[._-]?(.+)")
_OF_AUTHORS = re.compile(r"fl[._-]?\d+", re.ASCII)
_OTHER_UNIT = re.compile(rf"_({'|'.join(UNITS)})$")
SHAPES = (
    "Known are date,cluster,fruit,diameter_mm; tree,cluster,fruit,diam.2026-05-21 and so on;"
    " the same with diam.1 and so on and --dates; tag,fl1,fl2 and so on, in a sheet for each date."
)


def caliper_table(sheet: Sheet) -> Table | None:
    """The table of a sheet, None where it has no heading of this kind.

    Raises BadInput for a table in centimetres and the like.
    """
    table = find_table(sheet, _is_heading)
    if table is not None:
        _refuse_other_units(table)
    return table


def visit_columns(table: Table) -> dict[str, str]:
    """Columns of sizes by what tells their visit: a date, or a number."""
    found: dict[str, str] = {}
    for name in table.columns:
        if (visit := _visit(name)) is not None:
            table.check_once(name)
            if visit in found:
                raise BadInput(f"{table.name}: columns {found[visit]} and {name} are of one visit.")
            found[visit] = name
    return found


def is_visit_number(visit: str) -> bool:
    """Whether a visit is told by its number; one of five digits counts days."""
    return visit.isascii() and visit.isdigit() and not is_day(visit)


def authors_fruit(table: Table) -> list[str]:
    """The columns fl1, fl2 and so on."""
    found = [name for name in table.columns if _OF_AUTHORS.fullmatch(name)]
    for name in found:
        table.check_once(name)
    return found


def _is_heading(names: Sequence[str]) -> bool:
    """Two things of a caliper table at least, so that a missing one can be named."""
    kinds = (
        any(name in CLUSTER for name in names),
        any(name in FRUIT for name in names),
        any(name in DATE for name in names),
        any(map(_holds_sizes, names)),
    )
    return sum(kinds) >= 2


def _holds_sizes(name: str) -> bool:
    base = _OTHER_UNIT.sub("", name)
    return base in DIAMETER or _visit(base) is not None or bool(_OF_AUTHORS.fullmatch(base))


def _visit(name: str) -> str | None:
    if name in DIAMETER:
        return None
    told = _WIDE.fullmatch(name)
    visit = told[1] if told else name
    return visit if is_day(visit) or (told and is_visit_number(visit)) else None


def _refuse_other_units(table: Table) -> None:
    for name in table.columns:
        unit = _OTHER_UNIT.search(name)
        if unit is not None and _holds_sizes(name):
            raise BadInput(
                f"{table.name}: column {name} seems to be in {UNITS[unit[1]]}; is it?",
                "fieldcam needs millimetres, in a column diameter_mm.",
            )
