"""Analyses saved pairs in a process of its own, and waits for each."""

from __future__ import annotations

from fieldcam.analysis.supervisor import Supervisor
from fieldcam.codec.readings import EncodedReading
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Expectation


class SupervisedAnalyst:
    """A session's analyst whose crashes cost one pair at most."""

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> EncodedReading:
        """The reading of one saved pair."""
        return self._supervisor.submit(saved, expectation).result()
