"""What can be made to go wrong, on command."""

from __future__ import annotations

import math
from enum import StrEnum

ALWAYS = math.inf


class Fault(StrEnum):
    """Each strikes at the next occasion of its kind, as often as it is armed."""

    NO_ACK = "no-ack"
    """A command is done, but nothing is answered."""
    STALE_ACK = "stale-ack"
    """An ack of an older request comes first."""
    PENDING_ACK = "pending-ack"
    """The device asks for more time before it answers."""
    BUSY = "busy"
    """A command is refused with the status Busy."""

    STALL = "stall"
    """The stream endpoint halts in the middle of a frame."""
    BABBLE = "babble"
    """More comes than the host asked for."""
    LINK_ERROR = "link-error"
    """A transfer of a frame fails with a protocol error."""
    SHORT_FRAME = "short-frame"
    LONG_FRAME = "long-frame"
    NO_LEADER = "no-leader"
    NO_TRAILER = "no-trailer"
    MAGIC_IN_PAYLOAD = "magic-in-payload"
    """A payload transfer begins with what looks like a leader; nothing is wrong with it."""
    DISCARDED = "discarded"
    """The trailer says A100: data was discarded."""
    OVERRUN = "overrun"
    """The trailer says A101: data overrun."""
    BLOCK_GAP = "block-gap"
    """One block is never sent."""
    UNPLUG_MID_FRAME = "unplug-mid-frame"

    DARK = "dark"
    """The flash does not fire."""
    SILENT = "silent"
    """A trigger is not seen."""
    SWAPPED_EYES = "swapped-eyes"
    """The left eye gives the right picture."""
    BROWN_OUT = "brown-out"
    """The device drops off the bus within milliseconds of a trigger."""

    IN_USE = "in-use"
    """Claiming an interface gives EBUSY."""
    KERNEL_DRIVER = "kernel-driver"
    """A kernel driver holds the interfaces until it is detached."""
    NO_MEMORY = "no-memory"
    """A transfer gives ENOMEM."""


class Faults:
    """The armed faults of one camera."""

    def __init__(self) -> None:
        self._left: dict[Fault, float] = {}
        self._skipped: dict[Fault, int] = {}

    def arm(self, fault: Fault, times: float = 1, skip: int = 0) -> None:
        """Let it strike at the next `times` occasions, after letting `skip` pass."""
        self._left[fault] = times
        self._skipped[fault] = skip

    def disarm(self, fault: Fault) -> None:
        self._left.pop(fault, None)

    def armed(self, fault: Fault) -> bool:
        return self._left.get(fault, 0) > 0

    def strikes(self, fault: Fault) -> bool:
        """Whether it strikes now; each question is an occasion."""
        if not self.armed(fault):
            return False
        if self._skipped[fault] > 0:
            self._skipped[fault] -= 1
            return False
        self._left[fault] -= 1
        return True
