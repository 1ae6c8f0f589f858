"""The app with a camera without hardware, which follows the walker and misbehaves on command."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

from fieldcam.analysis.requests import Setup
from fieldcam.analysis.status import Limits
from fieldcam.camera.aimed import AimedCamera, Mishap
from fieldcam.session.events import Changed, Listener, LiveEvent
from fieldcam.session.live import LiveWalk
from fieldcam.store.rows import EntryId
from fieldcam.store.store import Store
from fieldcam.tui.wiring import Rig

DEADLINE_S = 120.0
"""Rendering takes seconds, more on a busy machine; a real camera has no such excuse."""
LIMITS = Limits(pair_s=30.0)
"""Rendering takes the cores that the analysis has to itself in the field."""
TRICKS = {
    Mishap.UNPLUGGED: ("unplug it", "The camera is unplugged."),
    Mishap.SLOW: ("be slow", "The next picture comes too late."),
    Mishap.DARK: ("no flash", "The next picture is dark."),
    Mishap.BLURRED: ("shake it", "The next picture is blurred."),
    Mishap.MISPAIRED: ("mix up pairs", "The next picture has eyes of two moments."),
    Mishap.SWAPPED_EYES: ("swap its eyes", "The next picture has its eyes swapped."),
}
"""What a command is called, and what it says."""


def start_walk(
    store: Store,
    visit: EntryId,
    camera: AimedCamera,
    setup: Setup,
    listener: Listener,
) -> LiveWalk:
    """A live walk before whose clusters the camera is aimed, one after the other."""

    def aim_and_tell(event: LiveEvent) -> None:
        if isinstance(event, Changed):
            camera.aim(event.state.tag_id)
        listener(event)

    return Rig(camera.open, setup, LIMITS, DEADLINE_S).walk(store, visit, aim_and_tell)


def tricks(camera: AimedCamera, mishaps: Iterable[Mishap]) -> Mapping[str, Callable[[], str]]:
    """Commands for the palette, by their names."""
    found = {f"Camera: {TRICKS[each][0]}": partial(_misbehave, camera, each) for each in mishaps}
    found["Camera: plug it in"] = partial(_plug_in, camera)
    found["Camera: press its shutter"] = partial(_press, camera)
    return found


def _misbehave(camera: AimedCamera, mishap: Mishap) -> str:
    camera.misbehave(mishap)
    return TRICKS[mishap][1]


def _plug_in(camera: AimedCamera) -> str:
    camera.misbehave(None)
    return "The camera is plugged in; it is found in a moment."


def _press(camera: AimedCamera) -> str:
    camera.press()
    return "The camera's own shutter was pressed."
