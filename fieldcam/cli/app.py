"""`fieldcam` alone: the app on the camera and the data folder of this machine."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from fieldcam.cli.arguments import Parser
from fieldcam.cli.console import at_a_terminal
from fieldcam.cli.launcher import launch
from fieldcam.cli.networks import checked_models
from fieldcam.errors import (
    BadInput,
    DeviceError,
    FieldcamError,
    RowsLost,
    StorageDamaged,
    StorageError,
)
from fieldcam.models import Models
from fieldcam.store.folder import data_path, demo_beside

NO_TERMINAL = (
    "The app needs a terminal that it can draw on, and there is none here.",
    "`fieldcam demo --headless` walks a simulated row without one, `fieldcam --help` lists more.",
)


def open_app(data: Path | None, parser: Parser) -> None:
    """Run the app, or the demo where that is chosen; `data` is what `--data` said.

    Raises BadInput without a terminal.
    """
    if not at_a_terminal():
        raise BadInput(*NO_TERMINAL)
    launch(partial(_open, data, parser))


def _open(data: Path | None, parser: Parser) -> None:
    from fieldcam.app.field import walk_field
    from fieldcam.store.lost_rows import check_rows
    from fieldcam.store.store import DATABASE_NAME
    from fieldcam.tui.questions.offer import Choice, offered

    path = data_path(data)
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
            demo = parser.parse_args(["demo"])
            demo.data = None if data is None else demo_beside(path)
            demo.handler(demo)
            return
    models, problems = _networks(data)
    try:
        walk_field(path, models, [*problems, *lines])
    except StorageDamaged as trouble:
        walk_field(path, models, [*problems, *_recovered(path, trouble)])


def _recovered(path: Path, trouble: StorageError) -> list[str]:
    """What was done, once the operator said yes; raises what is wrong where it was no."""
    from fieldcam.store.recovery import recover
    from fieldcam.store.recovery_words import recovery_lines
    from fieldcam.tui.questions.recover_offer import may_recover

    if not may_recover(trouble):
        raise trouble
    return list(recovery_lines(recover(path)))


def _no_camera(data: Path) -> str:
    """Why there is no camera; empty where there is one."""
    from fieldcam.camera.finding import look_for_camera

    try:
        look_for_camera(data)
    except DeviceError as error:
        return str(error)
    return ""


def _networks(data: Path | None) -> tuple[Models | None, list[str]]:
    """Those that cannot be used stop no walk, and a sentence says why: pictures wait."""
    try:
        return checked_models(data), []
    except FieldcamError as error:
        return None, [str(error)]
