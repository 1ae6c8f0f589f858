"""What the app begins with on a data folder: mending it, the offer of a demo, or the walk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fieldcam.app.field import walk_field
from fieldcam.camera.finding import look_for_camera
from fieldcam.errors import DeviceError, RowsLost, StorageDamaged, StorageError
from fieldcam.models import Models
from fieldcam.store.recovery.lost_rows import check_rows
from fieldcam.store.recovery.mending import recover
from fieldcam.store.recovery.words import recovery_lines
from fieldcam.store.store import DATABASE_NAME
from fieldcam.tui.questions.offer import Choice, offered
from fieldcam.tui.questions.recover_offer import may_recover


def begin(
    path: Path, networks: Callable[[], tuple[Models | None, list[str]]], demo: Callable[[], None]
) -> None:
    """Run the app, or the demo where the operator chooses it.

    `networks` gives those that are whole, and sentences where none is. Raises what is wrong
    with a database that the operator does not want to be mended.
    """
    lines: list[str] = []
    try:
        check_rows(path, DATABASE_NAME)
    except (RowsLost, StorageDamaged) as trouble:
        lines = _recovered(path, trouble)
    no_camera = "" if (path / DATABASE_NAME).exists() else _no_camera(path)
    if no_camera:
        choice = offered(no_camera)
        if choice is None:
            return
        if choice is Choice.DEMO:
            demo()
            return
    models, problems = networks()
    try:
        walk_field(path, models, [*problems, *lines])
    except StorageDamaged as trouble:
        walk_field(path, models, [*problems, *_recovered(path, trouble)])


def _recovered(path: Path, trouble: StorageError) -> list[str]:
    """What was done, once the operator said yes; raises what is wrong where it was no."""
    if not may_recover(trouble):
        raise trouble
    return list(recovery_lines(recover(path)))


def _no_camera(data: Path) -> str:
    """Why there is no camera; empty where there is one."""
    try:
        look_for_camera(data)
    except DeviceError as error:
        return str(error)
    return ""
