"""Who is using a data folder: many may write, one alone may tidy up."""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fieldcam.disk.durable import storage_error
from fieldcam.errors import StorageError

LOCK_NAME = "in-use.lock"


class FolderLock:
    """Held from opening to closing; the kernel lets go of it when the process dies."""

    def __init__(self, folder: Path) -> None:
        path = folder / LOCK_NAME
        try:
            self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            if error.errno in (errno.EROFS, errno.EACCES, errno.EPERM):
                raise StorageError(
                    f"{path} cannot be written: {error.strerror}.",
                    "Check the data folder's owner and that its disk is not read-only;"
                    " `fieldcam follow`, `growth`, `evaluate` and `export` look at it as it is.",
                ) from error
            raise storage_error(path, error) from error
        # Someone who tidies up alone is done within seconds.
        fcntl.flock(self._descriptor, fcntl.LOCK_SH)

    @contextmanager
    def alone(self) -> Iterator[bool]:
        """Whether no one else uses the folder, and then no one can until this ends."""
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            alone = True
        except BlockingIOError:
            alone = False
        try:
            yield alone
        finally:
            fcntl.flock(self._descriptor, fcntl.LOCK_SH)

    def close(self) -> None:
        """Let go of the folder; closing twice is fine."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1
