"""`fieldcam follow` and `fieldcam serve`: a running walk on another screen, to look at only."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from fieldcam.cli.arguments import Parser, Subparsers, add_command, port_number
from fieldcam.cli.console import at_a_terminal, narrate
from fieldcam.errors import BadInput, ExtraMissing, FieldcamError
from fieldcam.safe_path import PYTHON
from fieldcam.store.folder import data_path

LOOPBACK = "127.0.0.1"
PORT = 8000
OTHER_SCREEN = "TEXTUAL_DRIVER"
"""Textual's own sign that a server takes what is drawn, in place of a terminal."""


def register(commands: Subparsers[Parser]) -> None:
    add_command(commands, "follow", "show a running walk in this terminal", _follow)
    serve = add_command(commands, "serve", "show a running walk in a phone's browser", _serve)
    serve.add_argument(
        "--host",
        default=LOOPBACK,
        metavar="ADDRESS",
        help="listen at this address, 0.0.0.0 for all; the browser then asks for a code",
    )
    serve.add_argument("--port", type=port_number, default=PORT, metavar="N", help="8000")


def _follow(arguments: argparse.Namespace) -> None:
    if not (at_a_terminal() or OTHER_SCREEN in os.environ):
        raise BadInput(
            "`fieldcam follow` needs a terminal that it can draw on, and there is none here.",
            "`fieldcam serve` shows the walk in a browser.",
        )
    from fieldcam.tui.follow_app import follow

    follow(data_path(arguments.data))


def _serve(arguments: argparse.Namespace) -> None:
    try:
        from fieldcam.serving.addresses import is_for_this_machine_only, listen, page_address
        from fieldcam.serving.gate import Gate
        from fieldcam.serving.logs import keep_terminal_quiet
        from fieldcam.serving.server import PhoneServer, run
    except ImportError as error:
        raise ExtraMissing(
            "The phone's screen is not installed.", "pip install 'fieldcam[serve]'"
        ) from error
    data = data_path(arguments.data)
    with listen(arguments.host, arguments.port) as listener:
        narrate(f"The walk is shown at {page_address(listener)} (Ctrl+C ends this).")
        _say_what_is_missing(data)
        keep_terminal_quiet(data)
        gate = None if is_for_this_machine_only(listener) else Gate(_show_code)
        command = (*PYTHON, "-m", "fieldcam", "--data", str(data))
        run(PhoneServer((*command, "follow"), gate), listener)


def _say_what_is_missing(data: Path) -> None:
    """The page waits for the walk; whoever mistyped the folder would wait with it."""
    from fieldcam.store.read_only import open_read_only

    try:
        open_read_only(data).close()
    except FieldcamError as error:
        narrate(f"There is no walk to show yet, the page waits for one: {error}")


def _show_code(code: str) -> None:
    narrate(f"Code for the next browser: {code[:4]} {code[4:]}")
