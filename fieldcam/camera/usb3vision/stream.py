"""The image stream: arming the camera's stream, reading frames, and getting it going again.

Order, with what the owner does through the camera's features in brackets:
[AcquisitionStop, in case a program crashed; features; TLParamsLocked=1] arm
[AcquisitionStart] receive ... [AcquisitionStop] disarm [TLParamsLocked=0].
One thread at a time reads; nothing is read between two calls.
"""

from __future__ import annotations

import time
from contextlib import suppress

import numpy as np

from fieldcam.camera.genapi.registers import Registers
from fieldcam.camera.usb3vision.assembly import (
    FrameAssembler,
    SpoiledFrame,
    StreamCounts,
)
from fieldcam.camera.usb3vision.bootstrap import Sbrm, read_sirm, read_u32
from fieldcam.camera.usb3vision.frames import FramePool, UsbFrame
from fieldcam.camera.usb3vision.transfer_plan import (
    LARGEST_TRANSFER_BYTES,
    TransferPlan,
    disable_stream,
    enable_stream,
    plan_transfers,
    write_plan,
)
from fieldcam.camera.usb3vision.transport import (
    BulkIn,
    LinkFault,
    TransferFault,
    TransferOverflow,
    TransferTimeout,
)
from fieldcam.errors import CameraUnsupported, CaptureTimeout, FrameIncomplete

POOL_FRAMES = 4
"""One being filled, one or two being saved, one looked at."""
MID_FRAME_S = 0.5
"""The longest silence inside a frame; a deadline does not cut a frame off before it."""
MAX_FAULTS = 6
"""In a row, before the fault is the caller's."""
_QUIET_S = 0.01
_LONGEST_DRAIN_S = 0.5
_DRAIN_BYTES = 64 << 10
_SMALLEST_TRANSFER_BYTES = 64 << 10


class ImageStream:
    """The stream of one open camera."""

    def __init__(self, pipe: BulkIn, registers: Registers, sbrm: Sbrm) -> None:
        if not sbrm.sirm_address:
            raise CameraUnsupported("The camera has no image stream.")
        self._pipe = pipe
        self._registers = registers
        self._sbrm = sbrm
        self._address = sbrm.sirm_address
        self._largest_transfer = LARGEST_TRANSFER_BYTES
        self._assembler: FrameAssembler | None = None
        self._faults = 0

    @property
    def counts(self) -> StreamCounts:
        """Since the stream was armed last."""
        return StreamCounts() if self._assembler is None else self._assembler.counts

    def arm(self) -> TransferPlan:
        """Make ready for frames of the size that the camera's features now ask for.

        Whatever a program left behind that crashed here is stopped and thrown away.
        """
        disable_stream(self._registers, self._address)
        sirm = read_sirm(self._registers, self._sbrm)
        plan = plan_transfers(sirm, self._largest_transfer)
        write_plan(self._registers, sirm, plan)
        self._reset_endpoint()
        self._assembler = FrameAssembler(plan, FramePool(plan.capacity, POOL_FRAMES))
        enable_stream(self._registers, self._address)
        return plan

    def receive(self, timeout_s: float) -> UsbFrame:
        """The next whole frame.

        Raises FrameIncomplete as soon as one was spoiled, CaptureTimeout where none
        began in time, CameraUnplugged where the camera is gone; TransferFault where
        nothing but faults come, even after the stream was armed anew.
        """
        deadline_s = time.monotonic() + timeout_s
        while True:
            assembler = self._armed()
            left_s = deadline_s - time.monotonic()
            if assembler.in_block:
                left_s = max(left_s, MID_FRAME_S)
            elif left_s <= 0:
                raise CaptureTimeout(f"The camera sent no picture within {timeout_s:g} s.")
            outcome = self._step(assembler, left_s)
            if isinstance(outcome, UsbFrame):
                self._faults = 0
                return outcome
            if outcome is not None:
                raise FrameIncomplete(f"The picture {outcome.reason}.", "Take it again.")

    def flush(self) -> int:
        """Throw away frames that already came, and give how many.

        Before a trigger, so that the late frame of one that was given up is not taken
        for the answer. Ends after half a second where a camera runs by itself.
        """
        deadline_s = time.monotonic() + _LONGEST_DRAIN_S
        count = 0
        with suppress(CaptureTimeout):
            while time.monotonic() < deadline_s:
                with suppress(FrameIncomplete):
                    self.receive(_QUIET_S)
                count += 1
        return count

    def disarm(self) -> None:
        """Stop, and throw away what is still on its way; the camera may be armed again."""
        self._assembler = None
        self._drain()
        disable_stream(self._registers, self._address)

    def _armed(self) -> FrameAssembler:
        if self._assembler is None:
            raise CaptureTimeout("The camera's stream is off.")
        return self._assembler

    def _step(self, assembler: FrameAssembler, timeout_s: float) -> UsbFrame | SpoiledFrame | None:
        try:
            count = self._pipe.read(assembler.window(), timeout_s)
        except TransferTimeout:
            return assembler.abandon("stopped in the middle")
        except TransferFault as fault:
            spoiled = assembler.abandon(f"was cut off. {fault.message.rstrip('.')}")
            self._recover(fault)
            return spoiled
        return assembler.received(count, time.monotonic_ns())

    def _recover(self, fault: TransferFault) -> None:
        """After a bus error nothing is cleared: that can end in timeouts for good (aravis 301)."""
        self._faults += 1
        if self._faults > MAX_FAULTS:
            raise fault
        if isinstance(fault, LinkFault):
            # An unplugged camera first shows as a bus error; its registers tell.
            read_u32(self._registers, self._address)
        elif self._faults == 1:
            self._pipe.clear_halt()
        else:
            self._arm_anew(fault)

    def _arm_anew(self, fault: TransferFault) -> None:
        if isinstance(fault, TransferOverflow):
            halved = self._largest_transfer // 2
            self._largest_transfer = max(halved, _SMALLEST_TRANSFER_BYTES)
        counts = self.counts
        self.arm()
        self._armed().counts = counts

    def _reset_endpoint(self) -> None:
        """Setting and clearing a halt puts a camera's stream back to its start."""
        with suppress(TransferFault):
            self._pipe.halt()
        self._pipe.clear_halt()
        self._drain()

    def _drain(self) -> None:
        """Read until nothing comes, so that no old picture passes for a new one."""
        scratch = np.empty(_DRAIN_BYTES, np.uint8)
        deadline_s = time.monotonic() + _LONGEST_DRAIN_S
        with suppress(TransferFault):
            while time.monotonic() < deadline_s:
                self._pipe.read(scratch, _QUIET_S)
