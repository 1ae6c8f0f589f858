"""`head.json` beside pictures of a board: which head took them.

`{"left_serial": "40512345", "right_serial": "40512346"}`
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from fieldcam.errors import BadInput
from fieldcam.foreign.bounds import HEAD
from fieldcam.foreign.files import read_foreign

FILE_NAME = "head.json"


class _Head(msgspec.Struct):
    left_serial: str
    right_serial: str


def encode_head(serials: tuple[str, str]) -> bytes:
    """The file's content, from the serial numbers of the left and the right eye."""
    return msgspec.json.encode(_Head(*serials)) + b"\n"


def read_head(folder: Path) -> tuple[str, str] | None:
    """The serial numbers of the left and the right eye; None where nobody wrote them down."""
    path = folder / FILE_NAME
    if not path.exists():
        return None
    try:
        head = msgspec.json.decode(read_foreign(path, HEAD), type=_Head)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise BadInput(
            f"{path} does not say which head took the pictures.",
            "Remove it, and the calibration will name no head.",
        ) from error
    return head.left_serial, head.right_serial
