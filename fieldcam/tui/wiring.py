"""What the app is run with, whatever stands behind the camera's port."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from sqlite_utils import Database

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.status import Limits
from fieldcam.analysis.supervisor import DEFAULTS, Supervisor
from fieldcam.camera.port import FlashStereoDevice
from fieldcam.models import Models
from fieldcam.session.calibrating import CameraCalibration
from fieldcam.session.events import Listener
from fieldcam.session.live import LiveWalk
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.session.state import CameraState
from fieldcam.session.walk import DEADLINE_S
from fieldcam.store.queries.blocks import tag_size_mm
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store
from fieldcam.tui.app import FieldcamApp
from fieldcam.tui.ending import ended_by_signals
from fieldcam.tui.looks import chosen_look, in_theme
from fieldcam.tui.remembered import remember_theme, remembered_theme
from fieldcam.tui.sound import VARIABLE, chosen_sound
from fieldcam.tui.trick import Trick

SWITCH_S = 0.001
"""How long one thread may keep the interpreter from the others: to save a picture it is
asked for a dozen times, each of which may wait for so long behind a drawing screen."""


@dataclass(frozen=True, slots=True)
class Rig:
    """The camera of a walk, and the analysis of its pictures."""

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
        log = store.folder.path / "logs" / "analysis.log"
        analysis = with_cards_of(self.setup, store.database, visit)
        return LiveWalk(
            store,
            visit,
            self.open_camera,
            lambda changed: Supervisor(analysis, log, changed, self.limits),
            listener,
            self.deadline_s,
            self.calibration,
            *(() if setup is None else (setup.another_day,)),
        )


def with_cards_of(setup: Setup, database: Database, visit: EntryId) -> Setup:
    """Previews too are looked at for cards of the block's size."""
    size_mm = tag_size_mm(database, row_of(database, "visit", visit)["block"])
    return replace(setup, settings=replace(setup.settings, tag_size_mm=size_mm))


def run(
    start: Callable[[Listener], LiveWalk],
    lines: Sequence[str] = (),
    tricks: Sequence[Trick] = (),
    models: Models | None = None,
    setup: SetUp | None = None,
) -> None:
    """Run the app; whatever way it ends, the walk ends after it.

    Raises Stopped where a signal ended it.
    """
    sys.setswitchinterval(SWITCH_S)
    look = chosen_look(os.environ)
    if not look.colour:
        # Textual's own sign; it is read when the app is made.
        os.environ["NO_COLOR"] = "1"
    look = in_theme(look, remembered_theme())
    app = FieldcamApp(
        start,
        lines=lines,
        tricks=tricks,
        models=models,
        look=look,
        setup=setup,
        remember=remember_theme,
    )
    app.sound = chosen_sound(os.environ.get(VARIABLE, ""), app.bell)
    with ended_by_signals(app):
        try:
            app.run()
        finally:
            if app.walk is not None:
                if app.state is not None and app.state.camera is CameraState.EXPOSING:
                    say("Finishing the picture that is being taken …")
                app.walk.close()
    app.raise_defect()


def say(sentence: str) -> None:
    """On the terminal that the screens gave back."""
    with suppress(OSError):  # it may be closed
        sys.stderr.write(f"{sentence}\n")
        sys.stderr.flush()
