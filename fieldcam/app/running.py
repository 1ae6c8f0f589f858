"""Runs the app's screens over a walk, and ends the walk after them."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress

from fieldcam.models import Models
from fieldcam.session.events import Listener
from fieldcam.session.live import LiveWalk
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.session.state import CameraState
from fieldcam.tui.app import FieldcamApp
from fieldcam.tui.ending import ended_by_signals
from fieldcam.tui.looks import chosen_look, in_theme
from fieldcam.tui.remembered import remember_theme, remembered_theme
from fieldcam.tui.sound import VARIABLE, chosen_sound
from fieldcam.tui.trick import Trick

SWITCH_S = 0.001
"""How long one thread may keep the interpreter from the others: to save a picture it is
asked for a dozen times, each of which may wait for so long behind a drawing screen."""


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
