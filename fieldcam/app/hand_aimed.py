"""The app with a camera without hardware, which follows the walker and misbehaves on command."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from fieldcam.analysis.messages import Setup
from fieldcam.app.rendered import BESIDE_RENDERING, RENDER_DEADLINE_S
from fieldcam.app.rig import Rig
from fieldcam.camera.aimed import AimedCamera, Mishap
from fieldcam.session.calibrating import keep_known
from fieldcam.session.events import Changed, Listener, LiveEvent
from fieldcam.session.live import LiveWalk
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store
from fieldcam.tui.trick import Trick

TRICKS = {
    Mishap.UNPLUGGED: ("unplug it", "The camera is unplugged.", "Gone until it is plugged in"),
    Mishap.SLOW: ("be slow", "The next picture comes too late.", "Misses the next picture"),
    Mishap.DARK: ("no flash", "The next picture is dark.", "The next one is too dark"),
    Mishap.BLURRED: ("shake it", "The next picture is blurred.", "The next one is blurred"),
    Mishap.MISPAIRED: (
        "mix up pairs",
        "The next picture has eyes of two moments.",
        "The next one has eyes of two moments",
    ),
    Mishap.SWAPPED_EYES: (
        "swap its eyes",
        "The next picture has its eyes swapped.",
        "The next one has left and right exchanged",
    ),
}
"""What a command is called, what it says, and what comes of it."""


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

    calibration = keep_known(store, setup.camera)
    rig = Rig(camera.open, setup, BESIDE_RENDERING, RENDER_DEADLINE_S, calibration)
    return rig.walk(store, visit, aim_and_tell)


def tricks(camera: AimedCamera, mishaps: Iterable[Mishap]) -> tuple[Trick, ...]:
    """Commands for the palette."""
    press = "Takes the picture, as a button on the camera does"
    return (
        *(_trick(camera, mishap) for mishap in mishaps),
        Trick("Camera: plug it in", "It is found in a moment", partial(_plug_in, camera)),
        Trick("Camera: press its shutter", press, partial(_press, camera)),
    )


def _trick(camera: AimedCamera, mishap: Mishap) -> Trick:
    name, _, comes = TRICKS[mishap]
    return Trick(f"Camera: {name}", comes, partial(_misbehave, camera, mishap))


def _misbehave(camera: AimedCamera, mishap: Mishap) -> str:
    camera.misbehave(mishap)
    return TRICKS[mishap][1]


def _plug_in(camera: AimedCamera) -> str:
    camera.misbehave(None)
    return "The camera is plugged in; it is found in a moment."


def _press(camera: AimedCamera) -> str:
    camera.press()
    return "The camera's own shutter was pressed."
