"""What every row of the database has in common.

A row is a frozen dataclass whose fields are the columns of its table. Its id and
its who, when and why are added when it is appended.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from datetime import date
from enum import Enum
from typing import Any, ClassVar
from uuid import uuid4

from fieldcam.store.clock import Moment

EntryId = str
"""UUID of a row."""


@dataclass(frozen=True, slots=True)
class Row:
    """Base of all rows."""

    table: ClassVar[str]


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


def columns(row: Row) -> dict[str, Any]:
    """The row's fields as values that SQLite knows."""
    return {
        field.name: _stored(getattr(row, field.name))
        for field in fields(row)
        if hasattr(row, field.name)  # one that is made of the others comes last
    }


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
