"""One camera of a head: set up, started, triggered and read.

Its registers may be used by one thread while another one reads its stream.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from threading import Event

from fieldcam.camera.genapi import NodeMap
from fieldcam.camera.head.adjusting import Adjusted, Adjustment, Need, adjust, has, value_of
from fieldcam.camera.usb3vision.bootstrap import ClockSample, latch_clock, read_u32
from fieldcam.camera.usb3vision.clocks import DeviceClock, fit_clock
from fieldcam.camera.usb3vision.devices import OpenCamera
from fieldcam.camera.usb3vision.frames import UsbFrame
from fieldcam.camera.usb3vision.pairing import Half
from fieldcam.camera.usb3vision.pixels import decode
from fieldcam.errors import (
    CameraRefused,
    CameraSilent,
    CameraUnplugged,
    CaptureTimeout,
    DeviceError,
    FeatureMissing,
    FeatureRefused,
)

LATCH_EVERY_S = 10.0
"""Two crystals drift apart by a millisecond or two in this time."""
CLOCK_SAMPLES = 16
FIRST_SAMPLES = 4
"""On a busy machine one alone may be off by many milliseconds."""
STALE_NS = 5_000_000
"""A picture that was exposed this long before its trigger is another one's; beside what
the clocks themselves are unsure of."""
LOAD_S = 2.0
"""For a stored set of settings."""
SLICE_S = 0.05
"""How soon a camera gives up once the other one has failed."""
START, STOP, FIRE = "AcquisitionStart", "AcquisitionStop", "TriggerSoftware"
STREAMING = Adjustment("TLParamsLocked", 1, need=Need.IF_THERE)
STOPPED = Adjustment("TLParamsLocked", 0, need=Need.IF_THERE)


class EyeCamera:
    """Owns an open camera; one thread at a time uses it, but for `receive`."""

    def __init__(self, camera: OpenCamera, cache: Path, feature_file: Path | None = None) -> None:
        """Whatever a program left running that crashed is stopped.

        `feature_file` serves a camera whose own description cannot be read.
        """
        self._camera = camera
        self.serial = camera.abrm.serial
        self.speed = camera.speed
        described = camera.description(cache, feature_file)
        self.note = described.note
        """A sentence where its features are not by its newest own description."""
        self.features = NodeMap(described.document, camera.registers)
        self._stream = camera.stream()
        self._samples: deque[ClockSample] = deque(maxlen=CLOCK_SAMPLES)
        self._latched_s = float("-inf")
        self._in_step = False
        """The last trigger was answered in full, so that nothing is on its way."""
        self.fired_s = float("-inf")
        """When it had been triggered last, on the monotonic clock."""
        self.stop()

    @property
    def usb(self) -> OpenCamera:
        """For what lies beside the pictures, such as events."""
        return self._camera

    def set_up(self, wanted: Sequence[Adjustment]) -> Adjusted:
        """While it is stopped; see `adjust`.

        Begins with what the camera has when it is switched on, so that nothing stays of
        an earlier camera.toml or of another program.
        """
        with suppress(CameraRefused, FeatureMissing, FeatureRefused, CaptureTimeout):
            self._load_start()
        return adjust(self.features, wanted)

    def _load_start(self) -> None:
        started = "UserSetDefault"
        name = str(value_of(self.features, started)) if has(self.features, started) else "Default"
        self.features.enumeration("UserSetSelector").value = name
        self.features.command("UserSetLoad").run(LOAD_S)
        self.features.forget()

    def start(self) -> None:
        adjust(self.features, [STREAMING])
        self._stream.arm()
        self.features.command(START).execute()

    def stop(self) -> None:
        """Some cameras refuse to be stopped while they stand still."""
        with suppress(FeatureMissing, FeatureRefused, CameraRefused):
            self.features.command(STOP).execute()
        self._stream.disarm()
        adjust(self.features, [STOPPED])

    def clear(self) -> None:
        """Throw away late pictures, and look at the camera's clock now and then.

        That nothing more comes takes 10 ms to know; where the last trigger was answered
        and the clock would tell an old picture, they are saved.
        """
        if not self._in_step or not self._samples:
            self._stream.flush()
        if time.monotonic() - self._latched_s >= LATCH_EVERY_S:
            self._latched_s = time.monotonic()
            for _ in range(1 if self._samples else FIRST_SAMPLES):
                if (sample := self._latch()) is not None:
                    self._samples.append(sample)

    @property
    def clock(self) -> DeviceClock | None:
        """None where the camera's cannot be latched."""
        return fit_clock(self._samples) if self._samples else None

    def answer(self) -> None:
        """Raises CameraUnplugged where it is gone."""
        read_u32(self._camera.registers, 0)

    def fire(self) -> None:
        """Trigger it, once: where the answer is lost, the pictures tell whether it fired.

        A head that is starved by its flash goes before it has answered, so whether it is
        there is asked just before.
        """
        self.answer()
        self.fired_s = time.monotonic()
        with suppress(CameraSilent), self._camera.registers.acting():
            self.features.command(FIRE).execute()

    def receive(
        self, blocks: int, fired_ns: int | None, ends_s: float, given_up: Event
    ) -> list[Half]:
        """The blocks of the exposure that was triggered at this time (host's monotonic).

        Raises as ImageStream.receive does; CaptureTimeout at `ends_s` (monotonic), and
        once `given_up` is set.
        """
        halves: list[Half] = []
        self._in_step = False
        while len(halves) < blocks:
            left_s = ends_s - time.monotonic()
            if left_s <= 0 or given_up.is_set():
                raise _too_late(len(halves), blocks)
            with suppress(CaptureTimeout):
                frame = self._stream.receive(min(left_s, SLICE_S))
                if not self._is_stale(frame, fired_ns):
                    halves.append(_half(frame))
        self._in_step = True
        return halves

    def condition(self) -> str:
        """Temperature and link errors, as far as it tells; empty where it does not."""
        found = []
        with suppress(CameraSilent, CameraUnplugged):
            for name in ("DeviceTemperature", "LinkErrorCount", "LinkRecoveryCount"):
                found += self._told(name)
        counts = self._stream.counts
        found.append(f"{counts.frames} frames, {counts.spoiled} spoiled, {counts.lost} lost")
        return ", ".join(found)

    def _told(self, name: str) -> list[str]:
        """Nothing where it will not tell; raises CameraSilent or CameraUnplugged."""
        try:
            if has(self.features, name):
                return [f"{name} {value_of(self.features, name)}"]
        except (CameraSilent, CameraUnplugged):
            raise
        except DeviceError as error:
            return [f"{name} unknown ({error.message})"]
        return []

    def close(self) -> None:
        """Stop it where it still answers, and give it back; closing twice is fine."""
        with suppress(DeviceError):
            self.stop()
        self._camera.close()

    def _is_stale(self, frame: UsbFrame, fired_ns: int | None) -> bool:
        clock = self.clock
        if clock is None or fired_ns is None:
            return False
        unsure_ns = min(sample.uncertainty_ns for sample in self._samples)
        return clock.to_host_ns(frame.device_time_ns) < fired_ns - STALE_NS - 2 * unsure_ns

    def _latch(self) -> ClockSample | None:
        """By the register that all cameras should have, else by the feature."""
        with suppress(CameraRefused):
            return latch_clock(self._camera.registers)
        if not has(self.features, "TimestampLatch"):
            return None
        before_ns = time.monotonic_ns()
        self.features.command("TimestampLatch").execute()
        after_ns = time.monotonic_ns()
        device_ns = self.features.integer("TimestampLatchValue").value
        return ClockSample(device_ns, (before_ns + after_ns) // 2, (after_ns - before_ns) // 2)


def _too_late(came: int, wanted: int) -> CaptureTimeout:
    if came == 0:
        return CaptureTimeout("The camera sent no picture in time.", "Take it again.")
    return CaptureTimeout(
        f"The camera sent {came} of {wanted} pictures in time.",
        "Take it again; if it is so each time, check `layout` in camera.toml.",
    )


def _half(frame: UsbFrame) -> Half:
    image, pixel_format = decode(frame)
    return Half(image, pixel_format, frame.block_id, frame.device_time_ns)
