"""The analysis process of a data folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.status import AnalysisStatus, Limits
from fieldcam.analysis.supervisor import DEFAULTS, Supervisor


def _unheard(status: AnalysisStatus) -> None:
    """Nobody watches it."""


def start_analysis(
    setup: Setup,
    data: Path,
    changed: Callable[[AnalysisStatus], None] = _unheard,
    limits: Limits = DEFAULTS,
) -> Supervisor:
    """Reads pairs until it is closed; what it prints is kept in the data folder."""
    return Supervisor(setup, data / "logs" / "analysis.log", changed, limits)
