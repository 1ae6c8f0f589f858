"""A copy of a database to look at, where the file itself is not to be, or cannot be, written.

SQLite needs a file beside a write-ahead log that was left over, an old file its
migrations, and a damaged reading the word that it does not count.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlite_utils import Database

from fieldcam.disk.durable import storage_error
from fieldcam.store.connection import connect, rows
from fieldcam.store.migrations import migrate
from fieldcam.store.seals import DamagedReading, leave_out

_LOG = "-wal"


class PrivateCopy:
    """Lies in the system's folder for temporary files until it is closed."""

    def __init__(self, file: Path) -> None:
        self._folder = TemporaryDirectory(prefix="fieldcam-")
        copy = Path(self._folder.name) / file.name
        try:
            shutil.copyfile(file, copy)
            log = file.with_name(file.name + _LOG)
            if log.exists():
                shutil.copyfile(log, copy.with_name(log.name))
            # The images are found from where the database lies.
            copy.with_name("objects").symlink_to(file.parent.resolve() / "objects")
            self.database: Database = connect(copy)
            migrate(self.database, copy)
        except OSError as error:
            self._folder.cleanup()
            raise storage_error(copy, error) from error
        except BaseException:
            self._folder.cleanup()
            raise

    def leave_out(self, damaged: Sequence[DamagedReading]) -> None:
        """Let these readings count no more."""
        (here,) = rows(self.database, "SELECT device FROM here ORDER BY rowid DESC LIMIT 1")
        leave_out(self.database, here["device"], damaged)

    def close(self) -> None:
        self.database.close()
        self._folder.cleanup()
