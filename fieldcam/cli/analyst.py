"""The analysis process, for commands without a screen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.values import Calibration, Settings

if TYPE_CHECKING:
    from fieldcam.session.walk import Analyst


@contextmanager
def open_analyst(camera: Calibration | None, models: Path, data: Path) -> Iterator[Analyst]:
    """Reads pairs until it is left; `models` is where a user's own networks may lie.

    Without a camera's calibration every pair brings its own.
    """
    from fieldcam.analysis.messages import Setup
    from fieldcam.analysis.supervised import SupervisedAnalyst
    from fieldcam.analysis.supervisor import Supervisor

    setup = Setup(camera, Settings(), models)
    with Supervisor(setup, data / "logs" / "analysis.log") as supervisor:
        yield SupervisedAnalyst(supervisor)
