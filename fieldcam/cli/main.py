"""The `fieldcam` command: finds the subcommand, and turns errors into exit codes."""

from __future__ import annotations

import io
import logging
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from fieldcam import __version__
from fieldcam.cli import (
    app,
    demo,
    doctor,
    importing,
    models,
    recovering,
    routes,
    serving,
    sizing,
    stages,
    tag_cards,
)
from fieldcam.cli.arguments import Parser, folder_name
from fieldcam.cli.cameras import calibrating
from fieldcam.cli.cameras import commands as cameras
from fieldcam.cli.console import flush, narrate
from fieldcam.cli.over_days import evaluating, exporting, growth
from fieldcam.errors import OF_SIGNALS, ExitCode, FieldcamError, OutputLost, Stopped
from fieldcam.safe_path import keep_children_safe
from fieldcam.user_folders import UserFolder, temporary_folder, user_folder

GROUPS = (
    sizing,
    stages,
    importing,
    growth,
    evaluating,
    exporting,
    routes,
    demo,
    recovering,
    serving,
    tag_cards,
    cameras,
    calibrating,
    models,
    doctor,
)


def entry_point() -> None:
    """The installed command."""
    keep_children_safe()
    sys.exit(main())


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; gives its exit status."""
    _open_closed_streams()
    _replace_unknown_letters()
    try:
        return _run(argv)
    except OutputLost as error:
        _discard_output()
        narrate(f"fieldcam: {error}")
        return error.exit_code
    except FieldcamError as error:
        narrate(f"fieldcam: {error}")
        return error.exit_code
    except KeyboardInterrupt as end:
        narrate("fieldcam: stopped.")
        return OF_SIGNALS + (end.number if isinstance(end, Stopped) else signal.SIGINT)
    except BrokenPipeError:
        # The reader of our output went away, as `| head` does. Python would complain
        # again when it flushes at exit.
        _discard_output()
        return ExitCode.OK
    except Exception as error:  # the process edge: nothing may reach the operator as a traceback
        log = _record_defect()
        narrate(
            f"fieldcam: a defect of fieldcam itself ({type(error).__name__}); "
            f"please send {log} to its developers."
        )
        return ExitCode.DEFECT


def _run(argv: Sequence[str] | None) -> int:
    parser = build_parser()
    arguments = parser.parse_args(argv)
    if arguments.handler is None:
        app.open_app(arguments.data, parser)
    else:
        arguments.handler(arguments)
    flush()
    return ExitCode.OK


def _open_closed_streams() -> None:
    """Python has None for a stream that was closed before it started."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 (it is the stream)


def _replace_unknown_letters() -> None:
    """Names that a camera or a file brings hold letters that not every terminal has."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")


def _discard_output() -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def build_parser() -> Parser:
    """The parser with all commands."""
    parser = Parser(
        prog="fieldcam",
        description="Sizes tagged apple fruitlet clusters from a flash stereo camera.",
    )
    parser.set_defaults(handler=None)
    parser.add_argument("--version", action="version", version=f"fieldcam {__version__}")
    parser.add_argument(
        "--data",
        type=folder_name,
        metavar="DIR",
        help="the data folder (else FIELDCAM_DATA, else the user's own)",
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")
    for group in GROUPS:
        group.register(commands)
    return parser


def _record_defect() -> Path:
    """Append the traceback to the log file; gives that file's path."""
    user = user_folder(UserFolder.STATE)
    folders = [] if user is None else [user / "fieldcam"]
    for folder in [*folders, temporary_folder()]:
        path = folder / "fieldcam.log"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            handler = logging.FileHandler(path, encoding="utf-8")
        except OSError:
            continue
        handler.setFormatter(logging.Formatter("%(asctime)s %(name)s %(message)s"))
        logger = logging.getLogger("fieldcam.cli")
        logger.propagate = False
        logger.addHandler(handler)
        logger.exception("version=%s argv=%r", __version__, sys.argv)
        logger.removeHandler(handler)
        handler.close()
        return path
    return Path(os.devnull)
