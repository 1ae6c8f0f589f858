"""What the app asks of its analysis process and what that answers, as bytes on two pipes.

Each request gets one reply before the next is sent. Requests are pickled: they come from
the app itself. A reply may come from a process that is no longer sane, so it is JSON of a
declared form, after four bytes of length; a reading in it is the text that is stored.
"""

from __future__ import annotations

import pickle
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import msgspec

from fieldcam import errors
from fieldcam.codec.forms import TagForm, dump_form
from fieldcam.codec.readings import EncodedReading, dump_reading, parse_reading
from fieldcam.errors import AnalysisFailed, FieldcamError, ReadingInvalid
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Calibration, ClusterReading, Expectation, Settings, TagPose

_LENGTH = struct.Struct(">I")
LONGEST_BYTES = 64 << 20
"""A reading takes about one megabyte; whatever announces more than this is none."""


@dataclass(frozen=True, slots=True)
class Setup:
    """What stays the same from pair to pair."""

    camera: Calibration | Path | None
    """Of pairs that are already rectified, or the file or folder that describes the camera;
    None where every picture comes with its own calibration, which goes before this one anyway."""
    settings: Settings = field(default_factory=Settings)
    data: Path | None = None
    """The data folder, where a user's own networks may lie; None for the shipped ones."""


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Load all that the first pair would otherwise wait for."""

    setup: Setup


@dataclass(frozen=True, slots=True)
class Analyse:
    """Read one saved pair."""

    saved: SavedCapture
    expectation: Expectation


@dataclass(frozen=True, slots=True)
class FindTags:
    """Find the tags in a preview."""

    image: Path
    """PGM or PPM of the left eye."""
    shrunk: int
    """Full-size pixels to one of its own."""
    calibration: Path | None = None
    """Describes the camera, before the setup's one."""


@dataclass(frozen=True, slots=True)
class Ping:
    """Say that you are alive."""


Request = WarmUp | Analyse | FindTags | Ping
Tags = tuple[TagPose, ...]
"""Of a preview, in its own pixels."""
Answer = ClusterReading | Tags | FieldcamError | None
"""To Analyse, FindTags, any that could not be met, and WarmUp or Ping."""
Reply = EncodedReading | Tags | FieldcamError | None
"""An answer as the app gets it."""


class MessageInvalid(Exception):
    """The process says something that is no reply."""


def encode_request(request: Request) -> bytes:
    return pickle.dumps(request)


def requests_in(stream: BinaryIO) -> Iterator[Request]:
    """All that the app asks, as it comes, until it is gone."""
    try:
        while True:
            yield pickle.load(stream)
    except (EOFError, pickle.UnpicklingError):
        return


class _Form(msgspec.Struct, tag_field="is", frozen=True):
    """A reply as JSON has it."""


class _Done(_Form, tag="done", frozen=True):
    pass


class _Read(_Form, tag="reading", frozen=True):
    reading: msgspec.Raw


class _Seen(_Form, tag="tags", frozen=True):
    tags: tuple[TagForm, ...]


class _Failed(_Form, tag="error", frozen=True):
    error: str
    message: str
    hint: str


_decode = msgspec.json.Decoder(_Done | _Read | _Seen | _Failed).decode


def encode_reply(answer: Answer) -> bytes:
    """Raises ValueError where a number is not finite."""
    match answer:
        case None:
            form: _Form = _Done()
        case ClusterReading():
            text = dump_reading(answer).encode("ascii")
            return msgspec.json.encode(_Read(msgspec.Raw(text)))
        case FieldcamError(message=message, hint=hint):
            form = _Failed(type(answer).__name__, _sendable(message), _sendable(hint))
        case _:
            form = _Seen(tuple(TagForm.of(tag) for tag in answer))
    return dump_form(form).encode("ascii")


def decode_reply(document: bytes) -> Reply:
    """Raises MessageInvalid for anything that is no reply."""
    try:
        match _decode(document):
            case _Read(reading):
                return parse_reading(bytes(reading).decode())
            case _Seen(tags):
                return tuple(tag.value() for tag in tags)
            case _Failed(name, message, hint):
                return _error_class(name)(message, hint)
            case _:
                return None
    except (msgspec.DecodeError, ValueError, RecursionError, ReadingInvalid) as error:
        raise MessageInvalid("This is no reply.") from error


def _sendable(sentence: str) -> str:
    """File names are bytes, and what is no UTF-8 in them is none in JSON."""
    return sentence.encode(errors="replace").decode()


def _error_class(name: str) -> type[FieldcamError]:
    """Ours by its name; the nearest where it is not one of ours."""
    found = getattr(errors, name, None)
    if isinstance(found, type) and issubclass(found, FieldcamError):
        return found
    return AnalysisFailed


def frame(document: bytes) -> bytes:
    """One document as it travels."""
    if not 0 < len(document) <= LONGEST_BYTES:
        raise MessageInvalid(f"No reply has {len(document)} bytes.")
    return _LENGTH.pack(len(document)) + document


class Frames:
    """Puts documents together from bytes that come in pieces of any size."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, piece: bytes) -> Iterator[bytes]:
        """The documents that this piece completes; raises MessageInvalid for other streams."""
        self._buffer += piece
        while (end := self._end()) <= len(self._buffer):
            document = bytes(self._buffer[_LENGTH.size : end])
            del self._buffer[:end]
            yield document

    def _end(self) -> int:
        """How many bytes the first frame needs, as far as is known."""
        if len(self._buffer) < _LENGTH.size:
            return _LENGTH.size + 1
        length: int = _LENGTH.unpack_from(self._buffer)[0]
        if not 0 < length <= LONGEST_BYTES:
            raise MessageInvalid(f"A frame announces {length} bytes.")
        return _LENGTH.size + length
