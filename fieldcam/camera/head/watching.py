"""What goes on beside the pictures: the head's own shutter, and rest when nobody uses it."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from fieldcam.camera.genapi import NodeMap
from fieldcam.camera.head.adjusting import Adjustment, adjust, has
from fieldcam.camera.head.eyes import EyeCamera
from fieldcam.camera.usb3vision.events import EventChannel
from fieldcam.errors import CameraRefused, DeviceError

EVENT_WAIT_S = 0.1
POLL_EVERY_S = 0.03
"""A button is down for a tenth of a second."""
BOUNCE_S = 0.3
"""A press within this time of the last one is the same press."""
NOTIFICATION = "EventNotification"

log = logging.getLogger(__name__)

Pressed = Callable[[], bool]
"""Waits a little while; whether the button went down."""


class ShutterWatch:
    """Calls `pressed` whenever the button goes down, until it is closed or the camera is gone."""

    def __init__(
        self, camera: EyeCamera, line: str, registers: threading.RLock, pressed: Callable[[], None]
    ) -> None:
        """`registers` is held by whoever uses the camera's features."""
        self._pressed = pressed
        self._closing = threading.Event()
        with registers:
            self._went_down = by_event(camera, line) or by_level(
                camera.features, line, registers, self._closing
            )
        self._thread = threading.Thread(target=self._run, name="shutter", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        self._thread.join()

    def _run(self) -> None:
        last_s = float("-inf")
        try:
            while not self._closing.is_set():
                if self._went_down() and time.monotonic() - last_s > BOUNCE_S:
                    last_s = time.monotonic()
                    self._pressed()
        except DeviceError as error:
            # Whoever takes the next picture finds out what the matter is, and says so.
            log.warning("the button is not watched any more: %s", error.message)


def by_event(camera: EyeCamera, line: str) -> Pressed | None:
    """None where the camera tells no event of this line."""
    channel, features, name = camera.usb.events(), camera.features, f"{line}RisingEdge"
    if channel is None or not _has_event(features, name):
        return None
    others = [e for e in features.enumeration("EventSelector").symbols if e != name]
    # What a crashed program left on would pass for a press.
    wanted = [Adjustment(NOTIFICATION, False, ("EventSelector", other)) for other in others]
    if adjust(features, [*wanted, Adjustment(NOTIFICATION, True, ("EventSelector", name))]).lacks:
        return None
    try:
        channel.enable()
    except CameraRefused:
        return None
    return lambda: _event_came(channel)


def by_level(
    features: NodeMap, line: str, registers: threading.RLock, closing: threading.Event
) -> Pressed:
    """Looks at the line again and again."""
    was_high = True

    def went_down() -> bool:
        nonlocal was_high
        closing.wait(POLL_EVERY_S)
        with registers:
            high = line_is_high(features, line)
        rose, was_high = high and not was_high, high
        return rose

    return went_down


def line_is_high(features: NodeMap, line: str) -> bool:
    """Raises FeatureMissing where the camera shows no levels."""
    features.enumeration("LineSelector").value = line
    status = features.boolean("LineStatus")
    status.refresh()
    return status.value


def _has_event(features: NodeMap, name: str) -> bool:
    if not has(features, "EventSelector") or NOTIFICATION not in features:
        return False
    return name in features.enumeration("EventSelector").symbols


def _event_came(channel: EventChannel) -> bool:
    return channel.receive(EVENT_WAIT_S) is not None


class Rest:
    """Calls `rest` once when `stir` was not called for a while."""

    def __init__(self, after_s: float, rest: Callable[[], None]) -> None:
        self._after_s, self._rest = after_s, rest
        self._stirred, self._closing = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="rest", daemon=True)
        self._thread.start()

    def stir(self) -> None:
        self._stirred.set()

    def close(self) -> None:
        self._closing.set()
        self._stirred.set()
        self._thread.join()

    def _run(self) -> None:
        after_s: float | None = self._after_s
        while not self._closing.is_set():
            if self._stirred.wait(after_s):
                self._stirred.clear()
                after_s = self._after_s
            else:
                self._rest()
                after_s = None
