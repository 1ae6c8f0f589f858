"""A stereo head of USB3 Vision cameras, as the app uses it."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from enum import Enum, auto
from typing import Self

from fieldcam.camera.head.adjusting import Adjustment, adjust
from fieldcam.camera.head.exposing import exposed
from fieldcam.camera.head.opening import OpenHead
from fieldcam.camera.head.pictures import brightness, flash_fired, next_exposure_us, shrunk
from fieldcam.camera.head.plan import for_aiming, for_flash
from fieldcam.camera.head.settings import SOFTWARE
from fieldcam.camera.head.watching import Rest, ShutterWatch, line_is_high
from fieldcam.camera.preview import Preview
from fieldcam.camera.usb3vision.pairing import EyePair, raw_pair
from fieldcam.errors import (
    CameraPowerLost,
    CameraRefused,
    CameraUnplugged,
    DeviceError,
    FeatureMissing,
    FeatureRefused,
    FlashMissing,
    FrameIncomplete,
)
from fieldcam.values import Calibration, RawPair

POWER_LOST_S = 0.25
"""A camera that is found gone within this time of its flash, and the exposure, was most
likely starved by it, or by charging it again. The other eye takes SLICE_S of it to give
up, and a machine whose analysis is under way some more."""
MAX_EYES = 2

log = logging.getLogger(__name__)


class Lighting(Enum):
    """What the next exposure is lit by."""

    FLASH = auto()
    DAY = auto()


@dataclass(slots=True)
class _Aiming:
    """What previews found out about the light."""

    exposure_us: float
    per_us: float | None = None
    """Mean grey value that the light of the day gives in a microsecond."""
    possible: bool = True


class UsbStereoHead:
    """A `FlashStereoDevice`. It opens its cameras itself after a rest."""

    def __init__(self, open_cameras: Callable[[], OpenHead]) -> None:
        """Opens them; raises as `open_head` does."""
        self._open_cameras = open_cameras
        self._lock = threading.RLock()
        self._head: OpenHead | None = open_cameras()
        self.serials, self.notes = self._head.serials, self._head.notes
        settings = self._head.settings
        self._settings = settings
        self._aiming = _Aiming(settings.preview_us)
        self._streaming, self._light, self._flashed_s = False, Lighting.FLASH, float("-inf")
        self._triggers = 0
        self._watch: ShutterWatch | None = None
        self._pool = ThreadPoolExecutor(MAX_EYES, thread_name_prefix="eye")
        self._rest = Rest(settings.rest_after_s, self._lie_down)
        self._log_condition("opened")

    @property
    def calibration(self) -> Calibration | None:
        """USB3 Vision cameras know nothing of each other; the data folder has the file."""
        return None

    def capture(self, deadline_s: float) -> RawPair:
        """One flash and the pair of it; see `FlashStereoDevice`.

        Raises also FrameIncomplete, FlashMissing and CameraPowerLost.
        """
        ends_s = time.monotonic() + deadline_s
        with self._lock:
            head = self._awake()
            self._light_by(head, Lighting.FLASH)
            self._await_flash(ends_s)
            taken_at = datetime.now().astimezone()
            pair = self._exposed(head, ends_s)
            self._check_flash(pair)
            self._triggers += 1
            return raw_pair(pair, taken_at, self.serials, self._triggers)

    def preview(self, deadline_s: float) -> Preview | None:
        """None too where the flash cannot be kept from firing, or a line is the trigger."""
        ends_s = time.monotonic() + deadline_s
        with self._lock:
            head = self._awake()
            if self._settings.trigger != SOFTWARE or not self._aiming.possible:
                return None
            try:
                self._light_by(head, Lighting.DAY)
            except (FeatureMissing, FeatureRefused, CameraRefused) as error:
                log.warning("no preview: %s", error.message)
                self._aiming.possible = False
                return None
            with suppress(FrameIncomplete):
                pair = self._exposed(head, ends_s)
                self._follow_light(head, pair)
                left, step = shrunk(pair.left.image, pair.left.pixel_format)
                return Preview(left, step, self._flash_is_ready(head))
            return None

    def attend(self) -> None:
        """A head at rest that was given back is not asked."""
        with self._lock:
            for eye in () if self._head is None else self._head.eyes:
                eye.answer()

    def watch_shutter(self, pressed: Callable[[], None]) -> None:
        """Does nothing where the settings name no line for the button."""
        if not self._settings.shutter_line:
            return
        self._stop_watching()
        with self._lock:
            leader = self._awake().leader
            self._watch = ShutterWatch(leader, self._settings.shutter_line, self._lock, pressed)

    def close(self) -> None:
        self._rest.close()
        self._stop_watching()
        with self._lock:
            if self._head is not None:
                self._log_condition("closed")
                self._head.close()
                self._head = None
        self._pool.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _awake(self) -> OpenHead:
        self._rest.stir()
        if self._head is None:
            self._head = self._open_cameras()
            self._light = Lighting.FLASH
        if not self._streaming:
            self._head.start()
            self._streaming = True
        return self._head

    def _lie_down(self) -> None:
        """Cameras that stand still stay cool; without a button to watch they are given back."""
        with self._lock:
            if self._head is None:
                return
            self._streaming = False
            try:
                for eye in self._head.eyes:
                    eye.stop()
            except DeviceError as error:
                log.warning("going to rest: %s", error)
            if self._watch is None:
                self._head.close()
                self._head = None

    def _stop_watching(self) -> None:
        """Without the lock, which its thread may wait for."""
        watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()

    def _light_by(self, head: OpenHead, light: Lighting) -> None:
        if light is self._light:
            return
        features = head.leader.features
        if light is Lighting.DAY:
            line, exposure_us = self._settings.strobe_line, self._aiming.exposure_us
            adjust(features, for_aiming(features, line, exposure_us))
        else:
            adjust(features, for_flash(self._settings))
        self._light = light

    def _await_flash(self, ends_s: float) -> None:
        """A flash that is not charged yet would give a dark picture."""
        ready_s = self._flashed_s + self._settings.flash_pause_s
        time.sleep(max(0.0, min(ready_s, ends_s) - time.monotonic()))

    def _flash_is_ready(self, head: OpenHead) -> bool:
        if self._settings.charged_line:
            return line_is_high(head.leader.features, self._settings.charged_line)
        return time.monotonic() - self._flashed_s >= self._settings.flash_pause_s

    def _exposed(self, head: OpenHead, ends_s: float) -> EyePair:
        fired_before_s = head.leader.fired_s
        try:
            return exposed(head, self._pool, ends_s)
        except DeviceError as error:
            after_s = time.monotonic() - head.leader.fired_s - self._settings.exposure_us / 1e6
            head.assembly.restart()
            self._log_condition(f"{type(error).__name__}: {error.message}")
            lit = self._light is Lighting.FLASH and head.leader.fired_s > fired_before_s
            if lit and isinstance(error, CameraUnplugged) and after_s < POWER_LOST_S:
                raise _power_lost() from error
            raise
        finally:
            if self._light is Lighting.FLASH:
                self._flashed_s = head.leader.fired_s

    def _check_flash(self, pair: EyePair) -> None:
        """The right eye is asked too: a hand may cover the left one."""
        per_us = self._aiming.per_us
        ambient = None if per_us is None else per_us * self._settings.exposure_us
        means = [brightness(half.image) for half in (pair.left, pair.right)]
        if not any(flash_fired(mean, ambient) for mean in means):
            raise FlashMissing(
                "The flash did not fire.",
                "Wait until it is charged, check its power and cable, then take it again.",
            )

    def _follow_light(self, head: OpenHead, pair: EyePair) -> None:
        mean, before_us = brightness(pair.left.image), self._aiming.exposure_us
        self._aiming.per_us = mean / before_us
        exposure_us = next_exposure_us(before_us, mean)
        if exposure_us != before_us:
            self._aiming.exposure_us = exposure_us
            adjust(head.leader.features, [Adjustment("ExposureTime", exposure_us)])

    def _log_condition(self, occasion: str) -> None:
        for eye in () if self._head is None else self._head.eyes:
            with suppress(DeviceError):
                log.info("%s, camera %s: %s", occasion, eye.serial, eye.condition())


def _power_lost() -> CameraPowerLost:
    return CameraPowerLost(
        "The camera dropped off the bus just when its flash fired: most likely its port cannot"
        " feed it.",
        "Give the head power of its own or another port; if you pulled the cable, plug it in.",
    )
