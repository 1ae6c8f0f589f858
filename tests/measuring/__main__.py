"""`make measure`: prints a Markdown table of what the app takes on this machine.

PYTHONPATH=tests python -m measuring [--only keys times idle captures networks]
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from statistics import median, quantiles
from time import perf_counter

from processes import children, cpu_s, resident_mib
from terminals import ESCAPE
from torture.inspection import Announced, inspect
from torture.paths import IMPORTS
from torture.rowed_walk import open_folder

from measuring.apps import Scenery, Telling, render, telling_app
from measuring.quick import QUICK

KEYS = {
    "right": ("\x1b[C", "Next tag", "At tag"),
    "left": ("\x1b[D", "Previous tag", "At tag"),
    "capture": (" ", "Taking the picture", "saved"),
    "skip": ("k", "Skip", "skipped"),
    "undo": ("u", "Undo …", "Undone"),
}
"""What is pressed, what says that it was heard, and what that it was done."""
KEY_S = 2.0
PRESSES = 40
PICTURES, CAPTURES, READ = 3, 1000, 200
SETTLE_S, IDLE_S = 10.0, 60.0


def main() -> None:
    os.environ |= IMPORTS
    options = _options()
    say(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before this began;")
    say(f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC.\n")
    say("| figure | measured | goal |\n| --- | ---: | ---: |")
    scenery = render(PICTURES)
    for name in options.only:
        with tempfile.TemporaryDirectory(prefix="measuring-") as folder:
            for line in PARTS[name](Path(folder), scenery):
                say(f"{line} <!-- load {os.getloadavg()[0]:.1f} -->")


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def p95(values: Sequence[float]) -> float:
    return quantiles(values, n=20)[-1]


def _keys(folder: Path, scenery: Scenery) -> Iterator[str]:
    """Keys while pictures are being read without a pause."""
    with telling_app(folder, scenery) as told:
        heard_ms: list[float] = []
        done_ms: list[float] = []
        for number in range(PRESSES):
            while told.pending < 2:
                told.terminal.press(" ")
                told.look_on(0.3)
            for keys, heard, done in KEYS.values():
                took_ms = _pressed(told, keys, heard, done)
                heard_ms.append(took_ms[0])
                done_ms.append(took_ms[1])
                told.look_on(0.05 + 0.01 * (number % 7))
    for what, goal, took in ("screen", "50 ms", heard_ms), ("its answer", "", done_ms):
        yield (
            f"| key press to {what}, both networks running: p95 of {len(took)}"
            f" (median {median(took):.0f} ms) | {p95(took):.0f} ms | {goal} |"
        )


def _pressed(told: Telling, keys: str, heard: str, done: str) -> tuple[float, float]:
    """Milliseconds from the key to the first output that says something of it, and to its answer.

    An answer that comes before the screen is drawn takes the place of the other one.
    """
    terminal = told.terminal
    while terminal.look(0):
        pass
    before, started = len(terminal.seen), perf_counter()
    terminal.press(keys)
    heard_ms: float | None = None
    while True:
        took_ms = (perf_counter() - started) * 1000
        seen = ESCAPE.sub("", terminal.seen[before:])
        if heard_ms is None and (heard in seen or done in seen):
            heard_ms = took_ms
        if done in seen or took_ms > KEY_S * 1000:
            return took_ms if heard_ms is None else heard_ms, took_ms
        terminal.look(0.5)


def _times(folder: Path, scenery: Scenery) -> Iterator[str]:
    """One picture after the other, each read before the next is taken."""
    with telling_app(folder, scenery) as told:
        for number in range(1, 31):
            told.terminal.press(" ")
            told.wait_for(saved=number, read=number)
            told.look_on(0.3)
    saved, read = told.saved_ms, told.verdict_ms[1:]
    yield f"| capture to saved, median of {len(saved)} | {median(saved):.0f} ms | 30 ms |"
    yield (
        f"| capture to verdict, median of {len(read)} (p95 {p95(read) / 1000:.2f} s)"
        f" | {(median(saved) + median(read)) / 1000:.2f} s | 1.5 s |"
    )


def _idle(folder: Path, scenery: Scenery) -> Iterator[str]:
    """Nothing happens after the first picture was read."""
    with telling_app(folder, scenery) as told:
        told.terminal.press(" ")
        told.wait_for(read=1)
        told.look_on(SETTLE_S)
        (analysis,) = children(told.app)
        before = [cpu_s(told.app), cpu_s(analysis)]
        told.look_on(IDLE_S)
        used = [cpu_s(told.app) - before[0], cpu_s(analysis) - before[1]]
    app, apart = (f"{seconds / IDLE_S:.2%}" for seconds in used)
    yield f"| idle app, of one core over {IDLE_S:.0f} s (its analysis: {apart}) | {app} | 1 % |"


def _captures(folder: Path, scenery: Scenery) -> Iterator[str]:
    """Full pictures in a row, with an analysis that answers at once."""
    with telling_app(folder, scenery, QUICK) as told:
        size_mib: list[float] = []
        for number in range(1, CAPTURES + 1):
            told.terminal.press(" ")
            told.wait_for(saved=number, read=number)
            if number % 2 == 0:
                told.terminal.press("\x1b[C")
            if number % 100 == 0:
                size_mib.append(resident_mib(told.app))
        saved = told.saved_ms
        announced = Announced(set(told.keys))
    with open_folder(folder) as store:
        losses = inspect(store, announced)
    growth = size_mib[-1] / size_mib[0] - 1
    yield (
        f"| {CAPTURES} captures in a row: memory of the app from the 100th"
        f" ({size_mib[0]:.0f} MiB) to the last | {growth:+.1%} | 5 % |"
    )
    yield f"| the same: announced as saved and lost | {losses.lost + losses.without_image} | 0 |"
    late = f"p95 {p95(saved):.0f} ms"
    yield f"| the same: capture to saved, median ({late}) | {median(saved):.0f} ms | 30 ms |"


def _networks(folder: Path, scenery: Scenery) -> Iterator[str]:
    """The analysis process over many pictures."""
    with telling_app(folder, scenery) as told:
        size_mib: list[float] = []
        for number in range(1, READ + 1):
            told.terminal.press(" ")
            told.wait_for(saved=number, read=number)
            if number % 20 == 0:
                (analysis,) = children(told.app)
                size_mib.append(resident_mib(analysis))
    growth = size_mib[-1] / size_mib[0] - 1
    yield (
        f"| {READ} pictures read: memory of the analysis from the 20th"
        f" ({size_mib[0]:.0f} MiB) to the last | {growth:+.1%} | 5 % |"
    )


PARTS = {
    "keys": _keys,
    "times": _times,
    "idle": _idle,
    "captures": _captures,
    "networks": _networks,
}


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m measuring")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    return parser.parse_args()


if __name__ == "__main__":
    main()
