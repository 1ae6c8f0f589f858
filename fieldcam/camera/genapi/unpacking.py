"""The XML in a zipped feature file, as leniently as cameras pack it.

Cameras carry archives with extra fields of odd lengths, padding, and lists of contents
that are cut off, which zip libraries refuse. Here each file is read where it begins, by
its own header, and only as long as its data need it.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

from fieldcam.errors import FeatureFileInvalid
from fieldcam.foreign.bounds import FEATURES

FILE_START, LIST_START, EMPTY_START = b"PK\x03\x04", b"PK\x01\x02", b"PK\x05\x06"
STARTS = (FILE_START, EMPTY_START)
MAX_MEMBERS, MAX_TRIED = 64, 4
ROOT = b"RegisterDescription"
_HEADER = struct.Struct("<4xHHHHHIIIHH")
_ENCRYPTED, _SIZES_BEHIND = 1, 8
_STORED, _DEFLATED = 0, 8
ASK_THE_MAKER = (
    "Ask the camera's maker for its GenICam XML file, and name it under `feature_file` in"
    " camera.toml."
)


@dataclass(frozen=True, slots=True)
class _Member:
    name: str
    flags: int
    method: int
    checksum: int
    """0 where it stands behind the data."""
    data: memoryview
    """From its first byte on, to the archive's end."""
    packed_bytes: int
    """0 where it stands behind the data."""

    @property
    def is_xml(self) -> bool:
        return self.name.lower().endswith(".xml") and not self.name.startswith("__MACOSX/")

    @property
    def is_folder(self) -> bool:
        return self.name.endswith("/")


def unzipped_xml(data: bytes) -> bytes:
    """The feature file in an archive, among others; raises FeatureFileInvalid.

    Where none is called XML the first file: some cameras give it no name.
    """
    members = [member for member in _members(data) if not member.is_folder]
    if not members:
        raise FeatureFileInvalid("The zip holds no file.", ASK_THE_MAKER)
    named = [member for member in members if member.is_xml][:MAX_TRIED] or members[:1]
    found = [_unpacked(member) for member in named]
    return next((content for content in found if ROOT in content), found[0])


def _members(data: bytes) -> Iterator[_Member]:
    position = 0
    for _ in range(MAX_MEMBERS):
        if not data.startswith(FILE_START, position):
            return
        if position + _HEADER.size > len(data):
            raise _damaged()
        _version, flags, method, _time, _date, checksum, packed, _size, name, extra = (
            _HEADER.unpack_from(data, position)
        )
        begin = position + _HEADER.size
        text = data[begin : begin + name].decode("cp437")
        if flags & _SIZES_BEHIND:
            checksum = packed = 0
        content = memoryview(data)[begin + name + extra :]
        yield _Member(text, flags, method, checksum, content, packed)
        # Two signatures may follow; the next file's is the nearer one, where there is one.
        position = data.find(FILE_START, begin + name + extra + packed)
        if position < 0:
            return


def _unpacked(member: _Member) -> bytes:
    if member.flags & _ENCRYPTED or member.method not in (_STORED, _DEFLATED):
        raise FeatureFileInvalid(
            "The zip is encrypted, or packed in an unusual way.", ASK_THE_MAKER
        )
    if member.method == _STORED:
        found = _stored(member)
    else:
        inflater = zlib.decompressobj(-zlib.MAX_WBITS)
        try:
            found = inflater.decompress(member.data, FEATURES.most_bytes + 1)
        except zlib.error as error:
            raise _damaged() from error
        if not inflater.eof and len(found) <= FEATURES.most_bytes:
            raise _damaged()
    if len(found) <= FEATURES.most_bytes and member.checksum not in (0, zlib.crc32(found)):
        raise _damaged()
    return found


def _stored(member: _Member) -> bytes:
    """Where its length stands behind it, it ends where the list of contents begins."""
    data = member.data.tobytes()
    if member.packed_bytes:
        if member.packed_bytes > len(data):
            raise _damaged()
        return data[: member.packed_bytes]
    end = data.find(LIST_START)
    return data if end < 0 else data[:end]


def _damaged() -> FeatureFileInvalid:
    return FeatureFileInvalid("The zipped feature file is damaged.", ASK_THE_MAKER)
