"""What the camera's condition was when, in a file that stays small."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from logging.handlers import RotatingFileHandler
from pathlib import Path

LOGGER = "fieldcam.camera.head"
LARGEST_BYTES = 1 << 20


class _QuietHandler(RotatingFileHandler):
    """The screens are drawn where a full disk would otherwise be complained about."""

    def handleError(self, record: logging.LogRecord) -> None:
        """A line less in the log is no trouble."""


@contextmanager
def camera_log(folder: Path) -> Iterator[None]:
    """Temperatures, link errors and troubles go to `camera.log` in this folder meanwhile."""
    folder.mkdir(parents=True, exist_ok=True)
    handler = _QuietHandler(
        folder / "camera.log", maxBytes=LARGEST_BYTES, backupCount=1, delay=True
    )
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    logger = logging.getLogger(LOGGER)
    level, logger.propagate = logger.level, False
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
        logger.propagate = True
        handler.close()
