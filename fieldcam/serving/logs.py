"""What strangers send to the server is told in a file, not on the operator's terminal."""

from __future__ import annotations

import logging
from contextlib import suppress
from logging.handlers import RotatingFileHandler
from pathlib import Path

LARGEST_BYTES = 1 << 20
_TALKERS = ("aiohttp", "asyncio", "textual")


def keep_terminal_quiet(data: Path) -> None:
    """Until the process ends; without a data folder that takes a log nothing is kept."""
    handler: logging.Handler = logging.NullHandler()
    with suppress(OSError):
        if data.is_dir():
            (data / "logs").mkdir(exist_ok=True)
            file = data / "logs" / "serve.log"
            handler = RotatingFileHandler(file, maxBytes=LARGEST_BYTES, backupCount=1)
            handler.setFormatter(logging.Formatter("%(asctime)s %(name)s %(message)s"))
    for name in _TALKERS:
        logger = logging.getLogger(name)
        logger.addHandler(handler)
        logger.propagate = False
