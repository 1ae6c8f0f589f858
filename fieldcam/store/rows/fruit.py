"""Rows about single fruit: sizes by caliper, names, and who is who in two pictures."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from typing import ClassVar

from fieldcam.store.rows.judgements import Answer
from fieldcam.store.rows.row import EntryId, Row, same
from fieldcam.store.rows.subjects import IN_A_BLOCK, OfCluster, of_reading

_ONE_TO_ONE = (
    "other.one_reading = said.one_reading AND other.other_reading = said.other_reading"
    " AND (other.one_fruitlet = said.one_fruitlet OR other.other_fruitlet = said.other_fruitlet)"
    " OR other.one_reading = said.other_reading AND other.other_reading = said.one_reading"
    " AND (other.one_fruitlet = said.other_fruitlet OR other.other_fruitlet = said.one_fruitlet)"
)
"""Whichever of two readings is named first."""


@dataclass(frozen=True, slots=True)
class CaliperSize(Row):
    """A fruit of a cluster was measured on a day; the last such row counts."""

    table: ClassVar[str] = "caliper_size"
    named: ClassVar[str] = "the caliper size"
    about: ClassVar[OfCluster] = IN_A_BLOCK
    key: ClassVar[str] = same("block", "tag_id", "day", "fruit")
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
    named: ClassVar[str] = "the fruit's name"
    about: ClassVar[OfCluster] = of_reading()
    key: ClassVar[str] = f"{same('reading', 'fruitlet')} OR {same('reading', 'fruit')}"
    reading: EntryId
    fruitlet: int
    fruit: str


@dataclass(frozen=True, slots=True)
class AssociationWord(Row):
    """A fruitlet of one reading is this one of another, or is not in it; the last word counts."""

    table: ClassVar[str] = "association_word"
    named: ClassVar[str] = "the match"
    about: ClassVar[OfCluster] = of_reading("one_reading")
    key: ClassVar[str] = _ONE_TO_ONE
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
    named: ClassVar[str] = "the answer"
    visit: EntryId
    tag_id: int
    reading: EntryId
    """That of the earlier picture."""
    fruitlet: int
    answer: Answer
