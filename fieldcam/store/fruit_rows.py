"""Rows about single fruit: sizes by caliper, names, and who is who in two pictures."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from typing import ClassVar

from fieldcam.store.rows import EntryId, Row
from fieldcam.store.rows.judgements import Answer


@dataclass(frozen=True, slots=True)
class CaliperSize(Row):
    """A fruit of a cluster was measured on a day; the last such row counts."""

    table: ClassVar[str] = "caliper_size"
    block: EntryId
    tag_id: int
    day: date
    fruit: str
    """Its name in the cluster, such as `fl3`."""
    diameter_mm: float
    source: str | None = None
    """The file that it came from; None: typed at the tag."""


@dataclass(frozen=True, slots=True)
class CaliperIdentity(Row):
    """This fruitlet of this reading is the fruit of this name; the last word counts.

    A name that is given to another fruitlet of the reading is taken from the first.
    """

    table: ClassVar[str] = "caliper_identity"
    reading: EntryId
    fruitlet: int
    fruit: str


@dataclass(frozen=True, slots=True)
class AssociationWord(Row):
    """A fruitlet of one reading is this one of another, or is not in it; the last word counts."""

    table: ClassVar[str] = "association_word"
    one_reading: EntryId
    one_fruitlet: int
    other_reading: EntryId
    other_fruitlet: int | None = None
    """None: the other reading does not show it."""


@dataclass(frozen=True, slots=True)
class MissingWord(Row):
    """Why a visit's pictures do not show a fruitlet that an earlier picture shows.

    Which fruitlet it is; that one is missing is a mark on the cluster, written with it.
    """

    table: ClassVar[str] = "missing_word"
    visit: EntryId
    tag_id: int
    reading: EntryId
    """That of the earlier picture."""
    fruitlet: int
    answer: Answer
