"""A camera with the analysis of its pictures, whatever stands behind the camera's port."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from sqlite_utils import Database

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.status import Limits
from fieldcam.analysis.supervisor import DEFAULTS
from fieldcam.app.analysis import start_analysis
from fieldcam.camera.port import DEADLINE_S, FlashStereoDevice
from fieldcam.session.calibrating import CameraCalibration
from fieldcam.session.events import Listener
from fieldcam.session.live import LiveWalk
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.store.queries.blocks import tag_size_mm
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store


@dataclass(frozen=True, slots=True)
class Rig:
    """What a walk takes its pictures with, and reads them."""

    open_camera: Callable[[], FlashStereoDevice]
    """Raises CameraUnplugged where there is none; called again when a picture is wanted."""
    setup: Setup
    limits: Limits = DEFAULTS
    deadline_s: float = DEADLINE_S
    """How long a pair may take to arrive."""
    calibration: CameraCalibration | None = None
    """Goes with each picture; None where `setup` describes the camera."""

    def walk(
        self, store: Store, visit: EntryId, listener: Listener, setup: SetUp | None = None
    ) -> LiveWalk:
        """A walk of this visit, begun; with a `setup` the clock says which day it is."""
        analysis = with_cards_of(self.setup, store.database, visit)
        return LiveWalk(
            store,
            visit,
            self.open_camera,
            lambda changed: start_analysis(analysis, store.folder.path, changed, self.limits),
            listener,
            self.deadline_s,
            self.calibration,
            *(() if setup is None else (setup.another_day,)),
        )


def with_cards_of(setup: Setup, database: Database, visit: EntryId) -> Setup:
    """Previews too are looked at for cards of the block's size."""
    size_mm = tag_size_mm(database, row_of(database, "visit", visit)["block"])
    return replace(setup, settings=replace(setup.settings, tag_size_mm=size_mm))
