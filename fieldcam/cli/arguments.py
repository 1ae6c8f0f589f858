"""What the commands' arguments have in common."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import NoReturn

from fieldcam.errors import BadInput
from fieldcam.values import HIGHEST_TAG_ID

Subparsers = argparse._SubParsersAction  # argparse has no public name for it
Handler = Callable[[argparse.Namespace], None]
HIGHEST_PORT = 65_535


class Parser(argparse.ArgumentParser):
    """A parser whose complaints are BadInput, so that they end like all others."""

    def error(self, message: str) -> NoReturn:
        raise BadInput(f"{_sentence(message)}", f"See `{self.prog} --help`.")


def add_command(commands: Subparsers[Parser], name: str, summary: str, handler: Handler) -> Parser:
    """A subcommand with the options that every command has."""
    parser = commands.add_parser(name, help=summary, description=summary)
    parser.set_defaults(handler=handler)
    # SUPPRESS, so that `fieldcam --data DIR size …` is not overwritten by a default.
    parser.add_argument(
        "--data", type=folder_name, default=argparse.SUPPRESS, metavar="DIR", help="the data folder"
    )
    return parser


def folder_name(text: str) -> Path:
    """An empty one, as a variable that is not set leaves it, would be the current folder."""
    if not text:
        raise argparse.ArgumentTypeError("the folder's name is empty.")
    return Path(text)


def add_json(parser: Parser) -> None:
    parser.add_argument("--json", action="store_true", help="print one JSON document")


def positive_number(text: str) -> float:
    """An argparse type for lengths and the like."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value <= 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above zero")
    return value


def positive_count(text: str) -> int:
    """An argparse type for counts of at least one."""
    return _whole_number(text, 1)


def count(text: str) -> int:
    """An argparse type for counts that may be zero."""
    return _whole_number(text, 0)


def port_number(text: str) -> int:
    """An argparse type for a TCP port; 0 is any that is free."""
    found = _whole_number(text, 0)
    if found > HIGHEST_PORT:
        raise argparse.ArgumentTypeError(f"{text!r} is no port: they end at {HIGHEST_PORT}")
    return found


def tag_id(text: str) -> int:
    """An argparse type for an id of the family tag36h11."""
    found = _whole_number(text, 0)
    if found > HIGHEST_TAG_ID:
        raise argparse.ArgumentTypeError(f"{text!r} is no tag36h11: they end at {HIGHEST_TAG_ID}")
    return found


def name(text: str) -> str:
    """An argparse type for a block's name."""
    if not text.strip() or not text.isprintable():
        raise argparse.ArgumentTypeError(f"{text!r} is no name")
    return text.strip()


def day(text: str) -> date:
    """An argparse type for a date."""
    try:
        return date.fromisoformat(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r} is no date such as 2026-05-21") from error


def _whole_number(text: str, least: int) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10 and int(text) >= least):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least {least}")
    return int(text)


def _sentence(message: str) -> str:
    text = message[:1].upper() + message[1:]
    return text if text.endswith(".") else f"{text}."
