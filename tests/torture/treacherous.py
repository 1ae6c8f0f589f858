"""An analysis that hangs, crashes or lies now and then, by the picture's content."""

from __future__ import annotations

from live_walks import read
from scripted_analysis import DEEDS

from fieldcam.analysis.requests import Setup
from fieldcam.store.captures import SavedCapture
from fieldcam.values import ClusterReading, Expectation

FAULTS = (
    "segfault", "hang", "hang_with_interpreter", "fall", "garbage", "huge", "forged", "stumble",
)  # fmt: skip


def fault_of(saved: SavedCapture, one_in: int) -> str:
    """What this picture makes the analysis do; one picture in `one_in` is bad."""
    number = int(saved.left.name[:12], 16)
    return FAULTS[number // one_in % len(FAULTS)] if number % one_in == 0 else "nothing"


class Treacherous:
    """One picture in twelve is bad."""

    one_in = 12

    def __init__(self, setup: Setup) -> None:
        self.setup = setup

    def warm_up(self) -> None:
        pass

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading:
        DEEDS[fault_of(saved, self.one_in)]()
        return read(expectation.tag_id or 0)


class Hopeless(Treacherous):
    """Every picture is bad."""

    one_in = 1
