"""What the screen shows about the analysis, and what bounds it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class AnalysisState(StrEnum):
    """What the analysis is doing."""

    STARTING = "starting"
    """The first process is loading the networks."""
    READY = "ready"
    BUSY = "busy"
    """A pair is being read."""
    RESTARTING = "restarting"
    """A process was lost and the next one is loading the networks."""
    STOPPED = "stopped"
    """Nothing is read any more: closed, or given up."""


@dataclass(frozen=True, slots=True)
class AnalysisStatus:
    """The analysis at one moment."""

    state: AnalysisState = AnalysisState.STARTING
    pending: int = 0
    """Pairs that wait or are being read."""
    restarts: int = 0
    """Since the app started."""
    last_error: str = ""
    """The last sentence about what went wrong with the analysis itself."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Times and counts that bound the analysis."""

    pair_s: float = 10.0
    """How long one pair may take before the process is killed."""
    first_pair_s: float = 60.0
    """The same for the warm-up and for a process's first pair; a cold disk is slow."""
    ping_every_s: float = 5.0
    """How often an idle process is asked whether it still answers."""
    close_s: float = 1.0
    """How long `close` waits before it kills."""
    tries: int = 2
    """A pair that ended the process this often is not tried again by itself."""
    restarts: int = 5
    span_s: float = 60.0
    """More than `restarts` within this time, and the analysis is given up."""
