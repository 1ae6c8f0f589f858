"""`fieldcam follow` and `fieldcam serve`: a running walk on another screen, to look at only."""

from __future__ import annotations

import argparse
import sys

from fieldcam.cli.arguments import Parser, Subparsers, add_command, port_number
from fieldcam.cli.console import narrate
from fieldcam.errors import ExtraMissing
from fieldcam.store.folder import data_path

LOOPBACK = "127.0.0.1"
PORT = 8000


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
    from fieldcam.tui.follow_app import follow

    follow(data_path(arguments.data))


def _serve(arguments: argparse.Namespace) -> None:
    try:
        from fieldcam.serving.addresses import is_for_this_machine_only, listen, page_address
        from fieldcam.serving.gate import Gate
        from fieldcam.serving.server import PhoneServer, run
    except ImportError as error:
        raise ExtraMissing(
            "The phone's screen is not installed.", "pip install 'fieldcam[serve]'"
        ) from error
    with listen(arguments.host, arguments.port) as listener:
        narrate(f"The walk is shown at {page_address(listener)} (Ctrl+C ends this).")
        gate = None if is_for_this_machine_only(listener) else Gate(_show_code)
        command = (sys.executable, "-m", "fieldcam", "--data", str(data_path(arguments.data)))
        run(PhoneServer((*command, "follow"), gate), listener)


def _show_code(code: str) -> None:
    narrate(f"Code for the next browser: {code[:3]} {code[3:]}")
