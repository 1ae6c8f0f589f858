"""Whether a folder's database is the one of its pictures, found out before anything is written.

A database that was copied without its write-ahead log after a crash lacks its last rows,
or all of them; going on with it would hide them for good.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from itertools import islice
from pathlib import Path

from sqlite_utils import Database

from fieldcam.errors import RowsLost, StorageError
from fieldcam.store.connection import connect_untouched, rows
from fieldcam.store.facts import all_facts
from fieldcam.store.objects import CALIBRATION_SUFFIX, FACTS_SUFFIX, Objects
from fieldcam.words import number_of

MAX_LEFT = 4
"""Images without a row that crashes leave behind: two pairs."""
IMAGES_OF = "SELECT left_file AS name FROM capture UNION SELECT right_file FROM capture"


def check_rows(path: Path, database_name: str) -> None:
    """Raises RowsLost where many pictures of the data folder at `path` have no row.

    With the log beside it the database is whole: what has no row then, crashes left behind.
    """
    objects, file = Objects(path), path / database_name
    check_file(file)
    images = {found.name for found in objects.names() if _is_image(found)}
    # On a disk that takes no writing SQLite opens no file with a log; a copy shows its rows.
    if not images or (_has_log(file) and not os.access(path, os.W_OK)):
        return
    known = _known(file)
    if known is not None and _has_log(file):
        return
    few = 0 if known is None else MAX_LEFT
    lost = images if known is None else images - known
    if known is not None and len(lost) > few:
        lost = _of_pairs(objects, lost)
    if len(lost) <= few or not _more_intact(objects, lost, few):
        return
    raise RowsLost(_seen(path, file, len(lost), len(images)), _HINT)


def check_file(database: Path) -> None:
    """Raises StorageError where something else has the database's name."""
    if database.is_dir():
        raise StorageError(
            f"{database} is a folder, and the database should be there.",
            "Move this folder away; if the database is nowhere else, `fieldcam recover` then makes"
            " rows of the pictures.",
        )


_HINT = (
    "If the folder was copied, copy these files too. Where they are lost, `fieldcam recover`"
    " makes new rows of the pictures; until then nothing is written."
)


def _seen(path: Path, file: Path, lost: int, images: int) -> str:
    pictures = number_of((images + 1) // 2, "picture")
    log = _log(file).name
    if not file.is_file():
        return f"{path} holds {pictures} and no database: is {file.name}, with {log}, missing?"
    which = "any" if lost == images else str((lost + 1) // 2)
    seen = f"{path} holds {pictures}, and {file.name} has no row for {which} of them:"
    return f"{seen} was {log} beside it, and was it copied too?"


def _log(file: Path) -> Path:
    return file.with_name(f"{file.name}-wal")


def _has_log(file: Path) -> bool:
    try:
        return _log(file).stat().st_size > 0
    except OSError:
        return False


def _is_image(path: Path) -> bool:
    return path.suffix not in (CALIBRATION_SUFFIX, FACTS_SUFFIX)


def _of_pairs(objects: Objects, names: set[str]) -> set[str]:
    """Those that are of captures: facts name them, or others are as large, as of one camera.

    Single images are what a full disk left.
    """
    named = {
        name
        for facts in all_facts(objects)
        for name in (facts.capture.left_file, facts.capture.right_file)
    }
    sizes = {name: objects.path(name).stat().st_size for name in names}
    alike = Counter(sizes.values())
    return {name for name in names if name in named or alike[sizes[name]] > 1}


def _more_intact(objects: Objects, names: set[str], few: int) -> bool:
    """Whether more than so many are whole; the others are left alone at each start."""
    whole = (name for name in sorted(names) if objects.is_intact(name))
    return len(list(islice(whole, few + 1))) > few


def _known(file: Path) -> set[str] | None:
    """Images that a row names; None where there are no tables at all."""
    if not file.is_file():
        return None
    with closing(connect_untouched(file)) as database:
        tables = set(database.table_names())
        if "capture" not in tables:
            # Another program's file is refused by its own sentence.
            return None if not tables else set(_all_images(file))
        return {row["name"] for row in _named(database)}


def _named(database: Database) -> Iterator[dict[str, str]]:
    yield from rows(database, f"{IMAGES_OF} UNION SELECT file FROM object_file")


def _all_images(file: Path) -> Iterator[str]:
    return (path.name for path in Objects(file.parent).names())
