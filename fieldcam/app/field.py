"""The app on the camera and the data folder of this machine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fieldcam.analysis.messages import Setup
from fieldcam.app.rig import Rig
from fieldcam.app.running import run
from fieldcam.camera.finding import HeadFinder
from fieldcam.camera.head.logs import camera_log
from fieldcam.models import Models
from fieldcam.session.calibrating import OwnCalibration
from fieldcam.session.events import Listener
from fieldcam.session.live import LiveWalk
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.store.folder import DataKind
from fieldcam.store.recovery.startup import startup_check
from fieldcam.store.store import open_store


def walk_field(path: Path, models: Models | None, problems: Sequence[str] = ()) -> None:
    """Run the app on this data folder until the operator ends it.

    `models` are the networks in use, where they are whole; `problems` are sentences
    that it begins with, besides those of the start-up check.
    """
    with open_store(path, DataKind.FIELD) as store, camera_log(path / "logs"):
        found = startup_check(store).sentences
        own = OwnCalibration(store)
        rig = Rig(HeadFinder(path).open, Setup(None, data=path), calibration=own)
        setup = SetUp(store)
        setup.resume()

        def start(listener: Listener) -> LiveWalk:
            assert setup.visit is not None  # the app asks for a walk only where one is set up
            return rig.walk(store, setup.visit, listener, setup)

        run(start, [*problems, *found], models=models, setup=setup)
