"""Reads what strace wrote: the calls that change files, in the order in which they ended."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

CALLS = (
    "openat", "write", "pwrite64", "ftruncate", "fsync", "fdatasync",
    "rename", "unlink", "mkdir", "close", "lseek", "fallocate",
)  # fmt: skip
COMMAND = ["strace", "-f", "-xx", "-s", "1000000", "-e", f"trace={','.join(CALLS)}", "-o"]
_WHOLE = re.compile(r"(\w+)\((.*)\)\s+= (-?\d+)")
_BEGUN = re.compile(r"(\w+)\((.*) <unfinished \.\.\.>")
_RESUMED = re.compile(r"<\.\.\. (\w+) resumed>(.*)\)\s+= (-?\d+)")
_TEXT = re.compile(r'"((?:\\x[0-9a-f]{2})*)"')


@dataclass(frozen=True, slots=True)
class Call:
    """One successful system call."""

    name: str
    arguments: str
    result: int
    began: int
    ended: int
    """Lines of the trace: a sync does not cover what ended after it began."""

    @property
    def texts(self) -> list[bytes]:
        """Its quoted arguments: paths and data."""
        return [bytes.fromhex(found.replace("\\x", "")) for found in _TEXT.findall(self.arguments)]

    @property
    def numbers(self) -> list[int]:
        """Its numeric arguments, the descriptor first."""
        plain = _TEXT.sub("", self.arguments)
        return [int(word) for word in re.findall(r"(?<![\w.])\d+(?![\w.])", plain)]

    @property
    def paths(self) -> list[Path]:
        return [Path(text.decode()) for text in self.texts]


def calls(lines: Iterable[str]) -> Iterator[Call]:
    """Those that succeeded; a call that other threads interrupted in the trace is joined."""
    begun: dict[str, tuple[str, int]] = {}
    for number, line in enumerate(lines):
        process, _, rest = line.strip().partition(" ")
        rest = rest.strip()
        if found := _BEGUN.match(rest):
            begun[process] = (found[2], number)
            continue
        if found := _RESUMED.match(rest):
            before, began = begun.pop(process)
            name, arguments = found[1], before + found[2]
        elif found := _WHOLE.match(rest):
            name, arguments, began = found[1], found[2], number
        else:
            continue  # a signal, or the end of a thread
        if int(found[3]) >= 0:
            yield Call(name, arguments, int(found[3]), began, number)
