"""An analysis that hangs, crashes or lies now and then, by the picture's content."""

from __future__ import annotations

import sys
from pathlib import Path

from live_walks import read
from scripted_analysis import DEEDS

from fieldcam.analysis.child import serve
from fieldcam.analysis.messages import Tags
from fieldcam.safe_path import PYTHON
from fieldcam.store.captures import SavedCapture
from fieldcam.values import ClusterReading, Expectation

TREACHEROUS = (*PYTHON, "-m", "torture.treacherous", "12")
"""The command of a process to which one picture in twelve is bad."""
HOPELESS = (*TREACHEROUS[:-1], "1")
FAULTS = (
    "segfault", "hang", "hang_with_interpreter", "fall", "garbage", "huge", "forged", "stumble",
)  # fmt: skip


def fault_of(saved: SavedCapture, one_in: int) -> str:
    """What this picture makes the analysis do; one picture in `one_in` is bad."""
    number = int(saved.left.name[:12], 16)
    return FAULTS[number // one_in % len(FAULTS)] if number % one_in == 0 else "nothing"


class Treacherous:
    """One picture in `one_in` is bad."""

    def __init__(self, one_in: int) -> None:
        self.one_in = one_in

    def warm_up(self) -> None:
        pass

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading:
        DEEDS[fault_of(saved, self.one_in)]()
        return read(expectation.tag_id or 0)

    def look(self, image: Path, shrunk: int, calibration: Path | None) -> Tags:
        return ()


if __name__ == "__main__":
    serve(lambda setup: Treacherous(int(sys.argv[1])), int(sys.argv[2]))
