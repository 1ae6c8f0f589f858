"""`head.json` beside pictures of a board: which head took them.

`{"left_serial": "40512345", "right_serial": "40512346"}`
"""

from __future__ import annotations

import json
from pathlib import Path

from fieldcam.errors import BadInput
from fieldcam.exchange.json_fields import text
from fieldcam.foreign.bounds import HEAD
from fieldcam.foreign.files import read_foreign

FILE_NAME = "head.json"
KEYS = ("left_serial", "right_serial")


def encode_head(serials: tuple[str, str]) -> bytes:
    """The file's content, from the serial numbers of the left and the right eye."""
    return json.dumps(dict(zip(KEYS, serials, strict=True))).encode("ascii") + b"\n"


def read_head(folder: Path) -> tuple[str, str] | None:
    """The serial numbers of the left and the right eye; None where nobody wrote them down."""
    path = folder / FILE_NAME
    if not path.exists():
        return None
    try:
        document = json.loads(read_foreign(path, HEAD))
        left, right = (text(document[key]) for key in KEYS)
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise BadInput(
            f"{path} does not say which head took the pictures.",
            "Remove it, and the calibration will name no head.",
        ) from error
    return left, right
