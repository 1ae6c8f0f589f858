"""The app on the camera and the data folder of this machine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fieldcam.analysis.requests import Setup
from fieldcam.camera.finding import open_camera
from fieldcam.models import Models
from fieldcam.session.events import Listener
from fieldcam.session.live import LiveWalk
from fieldcam.session.setting_up import SetUp
from fieldcam.store.calibrations import calibration_in_use
from fieldcam.store.folder import DataKind
from fieldcam.store.startup import startup_check
from fieldcam.store.store import open_store
from fieldcam.tui.wiring import Rig, run

UNCALIBRATED = (
    "The camera is not calibrated here: pictures are kept, but not sized. Run `fieldcam calibrate`."
)


def walk_field(path: Path, models: Models | None, problems: Sequence[str] = ()) -> None:
    """Run the app on this data folder until the operator ends it.

    `models` are the networks in use, where they are whole; `problems` are sentences
    that it begins with, besides those of the start-up check.
    """
    calibration = calibration_in_use(path)
    rig = Rig(open_camera, Setup(calibration, data=path))
    doubts = [*problems, *([] if calibration else [UNCALIBRATED])]
    with open_store(path, DataKind.FIELD) as store:
        found = startup_check(store).sentences
        setup = SetUp(store)
        setup.resume()

        def start(listener: Listener) -> LiveWalk:
            assert setup.visit is not None  # the app asks for a walk only where one is set up
            return rig.walk(store, setup.visit, listener)

        run(start, [*doubts, *found], models=models, setup=setup)
