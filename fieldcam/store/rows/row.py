"""What every row of the database has in common, and how it is written and read.

A row is a frozen dataclass whose fields are the columns of its table. Its id and
its who, when and why are added when it is appended. All that is particular to a kind
of rows is said on its class: how undoing names it, what it is about, and of which rows
only the last one counts.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from datetime import date
from enum import Enum
from functools import cache
from types import NoneType
from typing import Any, ClassVar, TypeVar, get_args, get_origin, get_type_hints
from uuid import uuid4

from fieldcam.store.clock import Moment
from fieldcam.store.rows.subjects import OfBlock, OfCluster

EntryId = str
"""UUID of a row."""
_Made = TypeVar("_Made")


@dataclass(frozen=True, slots=True)
class Row:
    """Base of all rows."""

    table: ClassVar[str]
    named: ClassVar[str] = ""
    """What the operator is told was undone; empty: such a row cannot be undone."""
    about: ClassVar[OfCluster | OfBlock | None] = None
    """None: undone only with a row that was written together with it."""
    key: ClassVar[str] = ""
    """When two rows, `said` and `other`, say the same thing anew: the last one counts."""


@dataclass(frozen=True, slots=True)
class Draft:
    """A row whose id others need before it is written, or which happened earlier."""

    row: Row
    id: EntryId
    at: Moment | None = None
    """None: the moment of writing."""


def new_id() -> EntryId:
    """A fresh row id."""
    return str(uuid4())


def same(*names: str) -> str:
    """The key of rows that agree in these columns."""
    return " AND ".join(f"other.{name} IS said.{name}" for name in names)


def columns(row: Row) -> dict[str, Any]:
    """The row's fields as values that SQLite knows."""
    return {
        field.name: _stored(getattr(row, field.name))
        for field in fields(row)
        if hasattr(row, field.name)  # one that is made of the others comes last
    }


def from_columns(kind: type[_Made], values: Mapping[str, Any]) -> _Made:
    """A row, or any other dataclass, of the columns that its fields name.

    Texts become what the fields are: enums, dates and, of JSON, tuples.
    """
    plain: type = kind  # which is hashable, as mypy sees it
    return kind(**{name: _read(hint, values[name]) for name, hint in _hints(plain).items()})


@cache
def _hints(kind: type) -> dict[str, object]:
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind) if field.init}


def _stored(value: object) -> object:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, tuple | dict):
        return json.dumps(value, separators=(",", ":"), allow_nan=False)
    return value


def _read(hint: object, value: object) -> object:
    """What `_stored` made of a value of this type; anything else is left as it is."""
    if value is None:
        return None
    kind = get_args(hint)[0] if NoneType in get_args(hint) else hint
    if get_origin(kind) in (tuple, dict) and isinstance(value, str):
        value = json.loads(value)
    if get_origin(kind) is tuple and isinstance(value, list):
        return tuple(_read(get_args(kind)[0], each) for each in value)
    if not isinstance(kind, type) or isinstance(value, kind):
        return value
    if issubclass(kind, date) and isinstance(value, str):
        return kind.fromisoformat(value)
    return kind(value) if issubclass(kind, Enum | bool) else value
