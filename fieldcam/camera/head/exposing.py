"""One trigger and what comes of it, from all cameras of a head at once."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Executor, Future, wait
from threading import Event

from fieldcam.camera.head.eyes import EyeCamera
from fieldcam.camera.head.opening import OpenHead
from fieldcam.camera.head.settings import SOFTWARE
from fieldcam.camera.usb3vision.pairing import Eye, EyePair, Half
from fieldcam.errors import CameraUnplugged, CaptureTimeout, DeviceError, FrameIncomplete

Received = list[Half]


def exposed(head: OpenHead, pool: Executor, ends_s: float) -> EyePair:
    """Trigger, or wait for the line's edge, and give the pair of it.

    `ends_s` is on the monotonic clock. Raises FrameIncomplete, CaptureTimeout,
    CameraUnplugged, or what else a stream ends with. Nobody reads a stream any more
    when this returns.
    """
    by_line = head.settings.trigger != SOFTWARE
    if not by_line:
        # What a line triggered before it was asked for is the picture that is wanted.
        list(pool.map(EyeCamera.clear, head.eyes))
    given_up = Event()
    fired_ns = None if by_line else time.monotonic_ns()

    def receive(eye: EyeCamera) -> Received:
        try:
            return eye.receive(head.assembly.blocks, fired_ns, ends_s, given_up)
        except CaptureTimeout:
            raise
        except DeviceError:
            given_up.set()
            raise

    waiting = [pool.submit(receive, eye) for eye in head.eyes]
    try:
        if not by_line:
            head.leader.fire()
        wait(waiting)
    finally:
        given_up.set()
        wait(waiting)
    return _pair(head, _received(waiting))


def _pair(head: OpenHead, received: Sequence[Received]) -> EyePair:
    clocks = {
        place: clock
        for place, eye in zip(Eye, head.eyes, strict=False)
        if (clock := eye.clock) is not None
    }
    pair = head.assembly.pair(received, clocks)
    if pair is None:
        raise FrameIncomplete("Left and right picture are not of one flash.", "Take it again.")
    return pair


def _received(waiting: Sequence[Future[Received]]) -> list[Received]:
    """What all gave; raises the most telling of what went wrong."""
    errors = [error for future in waiting if (error := future.exception()) is not None]
    if not errors:
        return [future.result() for future in waiting]
    worst = min(errors, key=_rank)
    if isinstance(worst, CaptureTimeout) and len(errors) < len(waiting):
        silent = next(
            eye for eye, future in zip(Eye, waiting, strict=True) if future.exception() is worst
        )
        raise CaptureTimeout(
            f"Only one eye sent a picture, the {silent} one none in time.",
            "Check its cable and the wire between both eyes, then take it again.",
        ) from worst
    raise worst


def _rank(error: BaseException) -> int:
    """A camera that is gone explains all else; one that gave up explains nothing."""
    if isinstance(error, CameraUnplugged):
        return 0
    return 2 if isinstance(error, CaptureTimeout) else 1
