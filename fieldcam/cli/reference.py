"""The command-line reference, made from the parsers: `make reference` writes docs/commands.md."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from fieldcam.cli.arguments import Parser
from fieldcam.cli.console import emit
from fieldcam.cli.main import build_parser
from fieldcam.errors import ExitCode

INTRODUCTION = """\
# Commands

Made from the parsers of the program by `make reference`. What each command is for, with examples,
stands in the guides; `fieldcam COMMAND --help` prints the same as here.
"""
_COMMON = ("help", "data", "json")
"""Explained once for all commands."""


def reference() -> str:
    """All commands with their arguments, as Markdown."""
    parser = build_parser()
    parts = [INTRODUCTION, *_general(parser), *_commands(parser), *_exit_codes()]
    return "\n".join(parts)


def _general(parser: Parser) -> Iterator[str]:
    yield "## For every command\n"
    yield from _table(action for action in parser._actions if not _is_group(action))
    yield "`--json` prints one JSON document, where a command has it.\n"


def _commands(parser: Parser) -> Iterator[str]:
    """The subcommands at any depth, in the order of `--help`."""
    for group in parser._actions:
        if not isinstance(group, argparse._SubParsersAction):
            continue
        summaries = {choice.dest: choice.help for choice in group._choices_actions}
        for name, command in group.choices.items():
            yield f"## `{_usage(command)}`\n"
            yield f"{_sentence(summaries[name] or '')}\n"
            yield from _table(
                action
                for action in command._actions
                if action.dest not in _COMMON and not _is_group(action)
            )
            yield from _commands(command)


def _usage(command: Parser) -> str:
    """Its name, with what has to be given."""
    needed = (
        f"{action.option_strings[-1]} {_value(action)}" if action.option_strings else _value(action)
        for action in command._actions
        if not _is_group(action) and (action.required or not action.option_strings)
    )
    return " ".join([command.prog, *needed])


def _table(actions: Iterator[argparse.Action]) -> Iterator[str]:
    lines = [f"| {_name(action)} | {_meaning(action)} |" for action in actions]
    if lines:
        yield "\n".join(["| argument | meaning |", "| --- | --- |", *lines, ""])


def _name(action: argparse.Action) -> str:
    value = "" if action.nargs == 0 else f" {_value(action)}"
    names = [f"`{option}{value}`" for option in action.option_strings]
    return _cell(", ".join(names or [f"`{_value(action)}`"]))


def _value(action: argparse.Action) -> str:
    """What stands for the value in the usage line."""
    if action.metavar is not None:
        shown = action.metavar if isinstance(action.metavar, str) else " ".join(action.metavar)
    elif action.choices is not None:
        shown = "/".join(map(str, action.choices))
    else:
        shown = action.dest.upper()
    if action.nargs in ("*", "?"):
        return f"[{shown}]"
    return f"{shown} ..." if action.nargs == "+" else shown


def _meaning(action: argparse.Action) -> str:
    return _cell((action.help or "").replace("%(default)s", str(action.default)))


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _exit_codes() -> Iterator[str]:
    yield "## Exit status\n"
    lines = [f"| {code.value} | {_sentence(code.meaning)} |" for code in ExitCode]
    yield "\n".join(["| status | meaning |", "| --- | --- |", *lines, ""])


def _is_group(action: argparse.Action) -> bool:
    return isinstance(action, argparse._SubParsersAction)


def _sentence(text: str) -> str:
    text = text[:1].upper() + text[1:]
    return text if text.endswith(".") else f"{text}."


if __name__ == "__main__":
    emit(reference().rstrip())
