"""Rows about what happens on a walk: visits, captures, readings, events."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from datetime import date
from enum import StrEnum
from hashlib import sha256
from typing import Any, ClassVar

from fieldcam.store.rows.row import EntryId, Row, columns, same
from fieldcam.store.rows.subjects import OfBlock


class EventKind(StrEnum):
    """Something whose time is worth keeping."""

    SHUTTER = "shutter"
    SAVED = "saved"
    """Only where the time after the commit matters: the capture's own row says when it began."""
    VERDICT_SHOWN = "verdict_shown"
    ACCEPTED = "accepted"
    """Only where a screen wants it apart from the decision's own row."""
    WENT_TO = "went_to"
    """The operator turned to another tag or tree than the route's next."""
    VISIT_ENDED = "visit_ended"
    VISIT_OPENED = "visit_opened"
    """The app was opened on it, or came back to it from another block."""
    SIGNED_IN = "signed_in"
    """Whoever wrote the row is at the app from then on."""


class ObjectRole(StrEnum):
    """Why a file is kept that no capture names."""

    LOOSE_IMAGE = "loose_image"
    CALIBRATION = "calibration"


@dataclass(frozen=True, slots=True)
class Visit(Row):
    """A walk of a block on a day."""

    table: ClassVar[str] = "visit"
    block: EntryId
    day: date


@dataclass(frozen=True, slots=True)
class VisitDay(Row):
    """Corrects the day of a visit; the last such row counts."""

    table: ClassVar[str] = "visit_day"
    named: ClassVar[str] = "the visit's day"
    about: ClassVar[OfBlock] = OfBlock("(SELECT block FROM visit WHERE visit.id = word.visit)")
    key: ClassVar[str] = same("visit")
    visit: EntryId
    day: date


@dataclass(frozen=True, slots=True)
class Capture(Row):
    """A pair of image files; see RawPair for the camera's facts."""

    table: ClassVar[str] = "capture"
    visit: EntryId | None
    tag_expected: int | None
    view: int
    """1 for the first picture of a cluster on a visit."""
    retake_of: EntryId | None
    left_file: str
    """SHA-256 and ending; the file lies under `objects/`."""
    right_file: str
    left_bytes: int
    right_bytes: int
    pixel_format: str
    taken_at: str
    """ISO 8601 with offset, of the host."""
    left_timestamp_ns: int
    right_timestamp_ns: int
    left_serial: str
    right_serial: str
    trigger_ordinal: int
    simulated: bool
    source: str | None = None
    """Where an imported pair came from."""
    calibration: str | None = None
    """SHA-256 and ending of the file it came with; None: that of the camera in use."""


@dataclass(frozen=True, slots=True)
class ObjectFile(Row):
    """A file under `objects/` that no capture names."""

    table: ClassVar[str] = "object_file"
    file: str
    bytes: int
    role: ObjectRole


@dataclass(frozen=True, slots=True)
class Reading(Row):
    """What the analysis said about a capture; the columns repeat parts of the document."""

    table: ClassVar[str] = "reading"
    key: ClassVar[str] = same("capture")
    capture: EntryId
    document: str
    """A ClusterReading, as codec.readings writes it."""
    schema_version: int
    tag_read: int | None
    status: str
    reasons: tuple[str, ...]
    """Reason codes."""
    target_count: int
    """Fruitlets of the tagged cluster, sized or not."""
    sizes: tuple[dict[str, Any], ...]
    """For each fruitlet: id, in_target, cluster, diameter_mm or None, x_px, y_px."""
    models: dict[str, str]
    method: str
    stereo: str
    software_version: str
    duration_ms: float
    """From saved to reading."""
    sha256: str = field(init=False)
    """Of all other columns."""

    def __post_init__(self) -> None:
        values = columns(self)
        object.__setattr__(self, "sha256", seal(values[name] for name in SEALED_COLUMNS))


SEALED_COLUMNS = tuple(each.name for each in fields(Reading) if each.name != "sha256")


def seal(values: Iterable[object]) -> str:
    """SHA-256 of a row's values, as written or as bytes where they are texts."""
    found = sha256()
    for value in values:
        found.update(_as_bytes(value))
        found.update(b"\0")
    return found.hexdigest()


def _as_bytes(value: object) -> bytes:
    if isinstance(value, bytes):
        return value
    if isinstance(value, int | float):
        return repr(float(value)).encode()
    return str(value).encode()


@dataclass(frozen=True, slots=True)
class AnalysisFailure(Row):
    """The analysis gave no reading of a capture."""

    table: ClassVar[str] = "analysis_failure"
    capture: EntryId
    cause: str
    """A short code, such as `crashed` or `too_slow`."""
    message: str


@dataclass(frozen=True, slots=True)
class Event(Row):
    """Something happened; when is in the row's entry."""

    table: ClassVar[str] = "event"
    event: EventKind
    visit: EntryId | None = None
    capture: EntryId | None = None
    tag_id: int | None = None
    tree: EntryId | None = None
