"""Files without a row, as a crash between the image files and the row leaves them.

They are taken up, never deleted. The left eye is written first and the right one
directly after it, so two files of one size, one after the other, are a pair.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from fieldcam.store.connection import rows
from fieldcam.store.folder import DataKind
from fieldcam.store.objects import CALIBRATION_SUFFIX, FACTS_SUFFIX
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.walk import Capture, ObjectFile, ObjectRole
from fieldcam.store.store import Store
from fieldcam.values import PixelFormat

PAIR_WITHIN_S = 2.0
"""Longest time between the two files of a pair."""
_WHY = "its files were found without a row"


def sweep(folder: Path) -> int:
    """Delete what writers that died left under temporary names; how many."""
    left_over = list(folder.glob("objects/*/.*.part"))
    for path in left_over:
        path.unlink(missing_ok=True)
    return len(left_over)


def adopt_pairs(store: Store, orphans: Iterable[Path]) -> tuple[EntryId, ...]:
    """Take up pairs of files; those without a known pixel format stay loose."""
    adopted: list[EntryId] = []
    for left, right in _pairs(orphans):
        pixel_format = _pixel_format(store, left)
        if pixel_format is None:
            continue
        taken = datetime.fromtimestamp(left.stat().st_mtime).astimezone()
        facts = {
            "pixel_format": pixel_format,
            "taken_at": taken.isoformat(),
            "left_timestamp_ns": 0,
            "right_timestamp_ns": 0,
            "left_serial": "",
            "right_serial": "",
            "trigger_ordinal": 0,
            "simulated": store.folder.kind is DataKind.SIMULATED,
        }
        adopted += store.append(_capture(store, left.name, right.name, facts), why=_WHY)
    return tuple(adopted)


def keep_loose(store: Store, orphans: Iterable[Path]) -> tuple[str, ...]:
    """Give a row to files of which no capture can be made; the images among them."""
    images = []
    for path in orphans:
        calibration = path.suffix == CALIBRATION_SUFFIX
        role = ObjectRole.CALIBRATION if calibration else ObjectRole.LOOSE_IMAGE
        store.append(ObjectFile(path.name, path.stat().st_size, role), why=_WHY)
        if not calibration:
            images.append(path.name)
    return tuple(images)


def orphans(store: Store) -> tuple[Path, ...]:
    """Files under `objects/` that no row names, in the order they were written."""
    sql = (
        "SELECT left_file AS name FROM capture UNION SELECT right_file FROM capture"
        " UNION SELECT file FROM object_file"
    )
    known = {row["name"] for row in rows(store.database, sql)}
    found = (
        path
        for path in store.objects.names()
        if path.suffix != FACTS_SUFFIX and path.name not in known
    )
    return tuple(sorted(found, key=lambda path: path.stat().st_mtime_ns))


def _pairs(orphans: Iterable[Path]) -> Iterator[tuple[Path, Path]]:
    left = None
    for path in orphans:
        if left is not None and _belong_together(left, path):
            yield left, path
            left = None
        else:
            left = path


def _belong_together(left: Path, right: Path) -> bool:
    a, b = left.stat(), right.stat()
    near = abs(b.st_mtime_ns - a.st_mtime_ns) <= PAIR_WITHIN_S * 1e9
    return near and a.st_size == b.st_size and left.suffix == right.suffix


def _pixel_format(store: Store, left: Path) -> str | None:
    """A PGM does not say which colour filter lay before it; the last such picture does."""
    if left.suffix == ".ppm":
        return PixelFormat.RGB8
    found = rows(
        store.database,
        "SELECT pixel_format FROM capture JOIN entry USING (id)"
        " WHERE left_bytes = ? AND left_file LIKE '%' || ? ORDER BY turn DESC LIMIT 1",
        left.stat().st_size,
        left.suffix,
    )
    return found[0]["pixel_format"] if found else None


def _capture(store: Store, left: str, right: str, facts: dict[str, Any]) -> Capture:
    """Belongs to the visit of its day, where there is one."""
    day = datetime.fromisoformat(facts["taken_at"]).date()
    visits = rows(
        store.database,
        "SELECT id FROM visit JOIN entry USING (id) WHERE day = ? ORDER BY turn DESC LIMIT 1",
        day.isoformat(),
    )
    return Capture(
        visit=visits[0]["id"] if visits else None,
        tag_expected=None,
        view=1,
        retake_of=None,
        left_file=left,
        right_file=right,
        left_bytes=store.objects.path(left).stat().st_size,
        right_bytes=store.objects.path(right).stat().st_size,
        **facts,
    )
