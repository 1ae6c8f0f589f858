"""The pixels of stored images; PNG and JPEG are decoded by a process of their own.

`python -m fieldcam.session.decoding FILE` is that process: it loads the image library,
which the app's own must not, and writes the picture as PPM to its output.
"""

from __future__ import annotations

import os
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

from fieldcam.disk.image_headers import RAW_SUFFIXES
from fieldcam.disk.raw_images import decode_raw, encode_raw
from fieldcam.errors import ImageUnreadable
from fieldcam.safe_path import PYTHON
from fieldcam.values import ImageU8

DEADLINE_S = 20.0
"""Half a second does on an idle machine."""
NICENESS = 5
"""The screen and the next verdict go before."""


def stored_image(path: Path) -> ImageU8:
    """(H, W) of a PGM file, (H, W, 3) RGB of any other.

    Raises OSError where the file cannot be read, ImageUnreadable where it is damaged.
    """
    if path.suffix in RAW_SUFFIXES:
        return decode_raw(path.read_bytes(), path.name)
    path.stat()
    return _decoded(path)


@lru_cache(maxsize=2)
def _decoded(path: Path) -> ImageU8:
    """Kept for a screen that draws the same picture anew; a name says what is in its file."""
    command = [*PYTHON, "-m", "fieldcam.session.decoding", str(path)]
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=DEADLINE_S, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise ImageUnreadable(f"{path.name} could not be decoded in time.") from error
    if done.returncode:
        raise ImageUnreadable(f"{path.name} cannot be decoded.")
    return decode_raw(done.stdout, path.name)


def _decode(path: Path) -> None:
    # It loads the image library.
    from fieldcam.exchange.images import read_image

    os.nice(NICENESS)
    sys.stdout.buffer.write(encode_raw(read_image(path)))


if __name__ == "__main__":
    _decode(Path(sys.argv[1]))
