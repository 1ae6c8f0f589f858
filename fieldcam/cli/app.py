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
    FieldcamError,
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
    from fieldcam.app.beginning import begin

    path = data_path(data)

    def demo() -> None:
        chosen = parser.parse_args(["demo"])
        chosen.data = None if data is None else demo_beside(path)
        chosen.handler(chosen)

    begin(path, partial(_networks, data), demo)


def _networks(data: Path | None) -> tuple[Models | None, list[str]]:
    """Those that cannot be used stop no walk, and a sentence says why: pictures wait."""
    try:
        return checked_models(data), []
    except FieldcamError as error:
        return None, [str(error)]
