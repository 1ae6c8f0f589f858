"""Puts a data folder in order whose database is damaged, lost, or not that of its pictures.

Nothing is thrown away: the old database is kept beside the new one.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from fieldcam.disk.durable import fsync_folder, storage_error
from fieldcam.errors import RowsLost, StorageBusy, StorageDamaged, StorageError
from fieldcam.store.connection import connect_untouched
from fieldcam.store.facts import all_facts
from fieldcam.store.folder import DataFolder, DataKind, kind_of
from fieldcam.store.lock import FolderLock
from fieldcam.store.objects import Objects
from fieldcam.store.recovery.integrity import FileProblem, quick_check, rehash
from fieldcam.store.recovery.lost_rows import check_file, check_rows
from fieldcam.store.recovery.rebuilding import rebuild
from fieldcam.store.recovery.salvage import Salvage, readable_copy
from fieldcam.store.recovery.startup import StartupReport, startup_check
from fieldcam.store.space import Space
from fieldcam.store.store import DATABASE_NAME, Store, open_unchecked

_LOG = "-wal"
_INDEX = "-shm"


@dataclass(frozen=True, slots=True)
class Mended:
    """What of a damaged database is in the new one."""

    salvaged: int
    """Rows taken over."""
    lost: int
    """Rows that were seen and could not be."""
    rebuilt: int
    """Pictures whose rows were made again of the facts beside them."""


@dataclass(frozen=True, slots=True)
class Recovered:
    """What became of a data folder."""

    kept_as: str | None
    """The old database's name now; None where it was left as it is, or there was none."""
    mended: Mended | None
    """None where the database was not damaged."""
    report: StartupReport
    files: tuple[FileProblem, ...]
    """Every file that is missing or changed, old ones too."""

    @property
    def pictures(self) -> int:
        """That had no row, and have one now."""
        rebuilt = 0 if self.mended is None else self.mended.rebuilt
        return rebuilt + len(self.report.taken_up.captures)


def recover(path: Path) -> Recovered:
    """Make a damaged database anew, and rows of pictures that have none.

    Raises StorageBusy while another fieldcam has the folder open, and StorageError where
    there is nothing to recover.
    """
    kind = kind_of(path) or _kind_of_pictures(path)
    with _alone(path):
        mended, kept_as = _mended(path, kind)
    with open_unchecked(path, kind) as store:
        report = startup_check(store)
        return Recovered(kept_as, mended, report, rehash(store.database, store.objects))


def _kind_of_pictures(path: Path) -> DataKind:
    """Of a folder without its marker: what its pictures say."""
    if next(Objects(path).names(), None) is None:
        raise StorageError(f"There is no data folder at {path}.", "Name another with --data.")
    simulated = any(facts.capture.simulated for facts in all_facts(Objects(path)))
    return DataKind.SIMULATED if simulated else DataKind.FIELD


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    with closing(FolderLock(path)) as lock, lock.alone() as alone:
        if not alone:
            raise StorageBusy(
                f"Another fieldcam has {path} open.", "Close it, then recover the folder."
            )
        yield


def _mended(path: Path, kind: DataKind) -> tuple[Mended | None, str | None]:
    """What was done to the database, and what the old one is called now."""
    file = path / DATABASE_NAME
    check_file(file)
    if not file.is_file():
        return None, None
    try:
        with closing(connect_untouched(file)) as database:
            quick_check(database)
        check_rows(path, DATABASE_NAME)
    except StorageDamaged:
        return _made_anew(path, kind)
    except RowsLost:
        return None, _kept(file)
    return None, None


def _made_anew(path: Path, kind: DataKind) -> tuple[Mended, str]:
    """The new database takes the old one's place only once it is whole."""
    file = path / DATABASE_NAME
    try:
        with TemporaryDirectory(dir=path, prefix=".recovery-") as name:
            folder = Path(name)
            (folder / "objects").symlink_to(path.resolve() / "objects")
            (folder / "old").mkdir()
            with Store(DataFolder(folder, kind), FolderLock(folder), Space(path)) as store:
                mended = _filled(store, file, folder / "old")
            _sync(folder / DATABASE_NAME)
            kept_as = _kept(file)
            for end in (_LOG, _INDEX):
                # The old log would be taken for the new file's.
                file.with_name(file.name + end).unlink(missing_ok=True)
            (folder / DATABASE_NAME).replace(file)
            fsync_folder(path)
    except OSError as error:
        raise storage_error(file, error) from error
    return mended, kept_as


def _filled(store: Store, old: Path, folder: Path) -> Mended:
    with closing(readable_copy(old, folder)) as source:
        salvage = Salvage(source, store.database)
        salvage.take_all()
        rebuilt = rebuild(store, all_facts(store.objects))
        # What rested on the rows that were made again.
        salvage.take(salvage.left)
    return Mended(salvage.taken, len(salvage.left), len(rebuilt))


def _kept(file: Path) -> str:
    """Copy a database and its log to a name of their own, and give that."""
    number = 1
    while (copy := file.with_name(f"{file.name}.old-{number}")).exists():
        number += 1
    for end in ("", _LOG):
        part = file.with_name(file.name + end)
        if part.exists():
            target = copy.with_name(copy.name + end)
            try:
                shutil.copyfile(part, target)
                _sync(target)
            except OSError as error:
                raise storage_error(target, error) from error
    fsync_folder(file.parent)
    return copy.name


def _sync(path: Path) -> None:
    with path.open("rb") as stream:
        os.fsync(stream.fileno())
