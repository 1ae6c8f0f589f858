"""Room on the disk: asked for before a capture, and a reserve for the last rows."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from fieldcam.disk.durable import storage_error
from fieldcam.errors import StorageFull

NEEDED_BYTES = 64 << 20
"""Free space below which no capture is begun: some ten pairs with their readings."""
RESERVE_BYTES = 8 << 20
RESERVE_NAME = "reserve.bin"


class Space:
    """The free space of a data folder."""

    def __init__(
        self, folder: Path, needed: int = NEEDED_BYTES, reserve: int = RESERVE_BYTES
    ) -> None:
        self._folder = folder
        self._needed = needed
        self._reserve_bytes = reserve
        self._reserve = folder / RESERVE_NAME

    @property
    def free_bytes(self) -> int:
        """What a user's process may still write."""
        found = os.statvfs(self._folder)
        return found.f_bavail * found.f_frsize

    @property
    def reserve_bytes(self) -> int:
        """What is set aside now."""
        try:
            return self._reserve.stat().st_size
        except OSError:
            return 0

    def captures_left(self, bytes_each: float) -> int:
        """How many more may be begun."""
        return max(0, int((self.free_bytes - self._needed) // bytes_each) + 1)

    def check(self) -> None:
        """Raise StorageFull when a capture should not be begun."""
        found = os.statvfs(self._folder)
        free = found.f_bavail * found.f_frsize
        no_names_left = found.f_files > 0 and found.f_favail == 0
        if free < self._needed or no_names_left:
            raise StorageFull(
                f"Only {free / 1e6:.0f} MB are free for {self._folder}.",
                "Free some space before the next picture.",
            )

    def set_aside(self) -> bool:
        """Make the reserve where there is room for it; whether it is there now."""
        if self._reserve.exists():
            return True
        if self.free_bytes < self._needed + self._reserve_bytes:
            return False
        try:
            self._allocate()
        except FileExistsError:
            return True  # another process was faster
        except OSError as error:
            with suppress(OSError):
                self._reserve.unlink(missing_ok=True)
            found = storage_error(self._reserve, error)
            if isinstance(found, StorageFull):
                return False
            raise found from error
        return True

    def release(self) -> bool:
        """Give the reserve back to the disk; whether there was one."""
        try:
            self._reserve.unlink()
        except OSError:
            return False
        return True

    def _allocate(self) -> None:
        descriptor = os.open(self._reserve, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)
        try:
            os.posix_fallocate(descriptor, 0, self._reserve_bytes)
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
