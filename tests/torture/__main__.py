"""`make torture`: everything at full count; prints a Markdown table.

cd tests && python -m torture [--kills N] [--faults N] [--full N] [--every N] [--seed N]
        [--only kills faults full cuts]
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter

from torture import faults, kills, power_cuts
from torture.inspection import Losses
from torture.small_disks import on_a_small_disk, why_not

HEAD = "| what happened | times | announced pictures | lost | rows without image | damaged |"
SMALL_DISK = "24m"
PICTURES = 4
"""Of each sitting whose power is cut."""


def main() -> None:
    options = _options()
    say(f"{_cpu()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f};")
    say(f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC; seed {options.seed}.\n")
    say(f"{HEAD}\n| --- | ---: | ---: | ---: | ---: | ---: |")
    started = perf_counter()
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        for name in options.only:
            for line in PARTS[name](Path(folder), options):
                say(line)
    say(f"\nTook {(perf_counter() - started) / 60:.0f} min.")


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _row(what: str, times: object, losses: Losses) -> str:
    lost = losses.lost + losses.gaps
    figures = (times, losses.pictures, lost, losses.without_image, losses.damaged)
    return f"| {what} | " + " | ".join(map(str, figures)) + " |"


def _kills(folder: Path, options: argparse.Namespace) -> Iterator[str]:
    tally = kills.rounds(folder, options.kills, options.seed)
    each = ", ".join(f"{number} {victim}" for victim, number in sorted(tally.kills.items()))
    yield _row(f"kill -9 ({each})", tally.kills.total(), tally.losses)
    yield (
        f"| terminal left broken by these | {tally.terminals_broken} of {tally.lives} apps"
        " | | | | |"
    )


def _faults(folder: Path, options: argparse.Namespace) -> Iterator[str]:
    found = faults.suffer(folder, options.faults)
    each = ", ".join(f"{number} {fault}" for fault, number in sorted(found.faults.items()))
    yield _row(f"analysis fails ({each})", found.faults.total(), found.losses)
    yield f"| pictures left without an answer by these | {found.unanswered} | | | | |"


def _full(folder: Path, options: argparse.Namespace) -> Iterator[str]:
    mount = folder / "small"
    mount.mkdir()
    if reason := why_not(mount):
        yield f"| disk full: not run, {reason} | | | | | |"
        return
    arguments = f"{mount} {options.full} {options.seed}"
    found = on_a_small_disk(mount, SMALL_DISK, f"{sys.executable} -m torture.full_disk {arguments}")
    refused = found["said"]["StorageTrouble"]
    yield _row(f"disk full ({refused} times said)", options.full, Losses(**found["losses"]))
    yield f"| walks that did not go on with room again | {found['did_not_go_on']} | | | | |"


def _cuts(folder: Path, options: argparse.Namespace) -> Iterator[str]:
    if shutil.which("strace") is None:
        yield "| power cuts: not run, strace is not installed | | | | | |"
        return
    for flaw in power_cuts.FLAWS:
        found = power_cuts.recorded_and_cut(
            folder / f"cuts-{flaw}", PICTURES, options.every, options.seed, flaw
        )
        label = f"; to prove the check: {flaw} not synced" if flaw else ""
        yield _row(f"power cut, states opened{label}", found.states, found.losses)


def _cpu() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "unknown processor"


PARTS = {"kills": _kills, "faults": _faults, "full": _full, "cuts": _cuts}


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m torture")
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--faults", type=int, default=200)
    parser.add_argument("--full", type=int, default=100)
    parser.add_argument("--every", type=int, default=4, help="cut at each n-th call")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    return parser.parse_args()


if __name__ == "__main__":
    main()
