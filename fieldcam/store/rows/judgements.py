"""Rows about what the operator decides: decisions, marks, corrections, notes, undoing."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

from fieldcam.store.rows.row import EntryId, Row, same
from fieldcam.store.rows.subjects import ON_A_VISIT, OfCluster, of_capture, of_reading


class Action(StrEnum):
    """What becomes of a capture."""

    ACCEPT = "accept"
    RETAKE = "retake"
    DISCARD = "discard"


class Answer(StrEnum):
    """Why a cluster has fewer fruitlets than on the last visit."""

    FALLEN = "fallen"
    HIDDEN = "hidden"


class MarkKind(StrEnum):
    """What the operator sees and the camera cannot."""

    FALLEN = "fallen"
    HIDDEN = "hidden"
    KING = "king"
    NOT_A_FRUITLET = "not_a_fruitlet"
    ADDED_BY_HAND = "added_by_hand"


@dataclass(frozen=True, slots=True)
class Decision(Row):
    """The operator's word on a capture; the last one that was not undone counts."""

    table: ClassVar[str] = "decision"
    named: ClassVar[str] = "the decision"
    about: ClassVar[OfCluster] = of_capture()
    key: ClassVar[str] = same("capture")
    capture: EntryId
    action: Action
    answer: Answer | None = None
    """To CONFIRM's question, where it was asked."""


@dataclass(frozen=True, slots=True)
class Skip(Row):
    """A cluster is left out on this visit."""

    table: ClassVar[str] = "skip"
    named: ClassVar[str] = "the skipping"
    about: ClassVar[OfCluster] = ON_A_VISIT
    visit: EntryId
    tag_id: int


@dataclass(frozen=True, slots=True)
class FruitletMark(Row):
    """A mark on a reading's fruitlet, or on a cluster at a visit; `on_*` make them."""

    table: ClassVar[str] = "fruitlet_mark"
    named: ClassVar[str] = "the mark"
    about: ClassVar[OfCluster] = of_reading() | ON_A_VISIT
    mark: MarkKind
    reading: EntryId | None = None
    fruitlet: int | None = None
    """Its id in the reading; None on a reading: one that the reading does not have."""
    visit: EntryId | None = None
    tag_id: int | None = None
    count: int = 1
    """How many fruitlets, where they are not told apart."""
    x_px: float | None = None
    """In the rectified left image."""
    y_px: float | None = None
    diameter_mm: float | None = None
    """Of a fruitlet measured by hand."""

    @classmethod
    def on_fruitlet(cls, mark: MarkKind, reading: EntryId, fruitlet: int) -> FruitletMark:
        """A mark on one fruitlet of a reading."""
        return cls(mark, reading=reading, fruitlet=fruitlet)

    @classmethod
    def on_cluster(
        cls, mark: MarkKind, visit: EntryId, tag_id: int, count: int = 1
    ) -> FruitletMark:
        """A mark on fruitlets that no reading of this visit shows."""
        return cls(mark, visit=visit, tag_id=tag_id, count=count)


@dataclass(frozen=True, slots=True)
class TagCorrection(Row):
    """A capture shows this tag, whatever was read or expected."""

    table: ClassVar[str] = "tag_correction"
    named: ClassVar[str] = "the tag's correction"
    about: ClassVar[OfCluster] = of_capture()
    key: ClassVar[str] = same("capture")
    capture: EntryId
    tag_id: int


@dataclass(frozen=True, slots=True)
class TargetCorrection(Row):
    """The tagged cluster of a reading is this one (`Fruitlet.cluster`)."""

    table: ClassVar[str] = "target_correction"
    named: ClassVar[str] = "the choice of the target"
    about: ClassVar[OfCluster] = of_reading()
    key: ClassVar[str] = same("reading")
    reading: EntryId
    cluster: int


@dataclass(frozen=True, slots=True)
class Note(Row):
    """Free text about any other row: a capture, a cluster, a visit, a block."""

    table: ClassVar[str] = "note"
    named: ClassVar[str] = "the note"
    about: ClassVar[OfCluster] = of_capture("subject")
    text: str
    subject: EntryId | None = None


@dataclass(frozen=True, slots=True)
class Undo(Row):
    """`target` counts no more, or again; never names another Undo."""

    table: ClassVar[str] = "undo"
    target: EntryId
    undone: bool = True
