"""What the analysis process answers, and the JSON form of it."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam import errors
from fieldcam.analysis.frames import FrameInvalid
from fieldcam.errors import AnalysisFailed, FieldcamError, ReadingInvalid
from fieldcam.exchange.json_fields import Json, text
from fieldcam.exchange.reading_parts import decode_tag, encode_tag
from fieldcam.exchange.readings import decode_reading, encode_reading
from fieldcam.values import ClusterReading, TagPose


@dataclass(frozen=True, slots=True)
class Done:
    """Answers a warm-up and a ping."""


@dataclass(frozen=True, slots=True, eq=False)
class Read:
    """Answers with a reading."""

    reading: ClusterReading


@dataclass(frozen=True, slots=True)
class Seen:
    """Answers with the tags of a preview, in its own pixels."""

    tags: tuple[TagPose, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Failed:
    """Answers that this request could not be met; the process goes on."""

    error: FieldcamError


Reply = Done | Read | Seen | Failed


def encode_reply(reply: Reply) -> Json:
    match reply:
        case Done():
            return {"is": "done"}
        case Read(reading):
            return {"is": "reading", "reading": encode_reading(reading)}
        case Seen(tags):
            return {"is": "tags", "tags": [encode_tag(tag) for tag in tags]}
        case Failed(error):
            name = type(error).__name__
            return {"is": "error", "error": name, "message": error.message, "hint": error.hint}


def decode_reply(document: object) -> Reply:
    """Raises FrameInvalid for anything that is no reply."""
    if not isinstance(document, dict):
        raise FrameInvalid("A reply is no JSON object.")
    try:
        return _decode_reply(document)
    except (KeyError, TypeError, ValueError, ReadingInvalid) as error:
        raise FrameInvalid("A reply is damaged.") from error


def _decode_reply(document: Json) -> Reply:
    match document["is"]:
        case "done":
            return Done()
        case "reading":
            return Read(decode_reading(document["reading"]))
        case "tags":
            return Seen(tuple(decode_tag(tag) for tag in document["tags"]))
        case "error":
            error = _error_class(text(document["error"]))
            return Failed(error(text(document["message"]), text(document["hint"])))
    raise FrameInvalid("A reply is of no known kind.")


def _error_class(name: str) -> type[FieldcamError]:
    """Ours by its name; the nearest where it is not one of ours."""
    found = getattr(errors, name, None)
    if isinstance(found, type) and issubclass(found, FieldcamError):
        return found
    return AnalysisFailed
