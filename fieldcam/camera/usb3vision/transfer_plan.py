"""How a block is cut into transfers, and the stream's registers that tell the camera so.

The rule is that of NI's kernel driver: transfers of one size, then one for the rest.
aravis makes the transfer as small as a small image, which need not be aligned and which
some cameras then refuse (status A003).
"""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.camera.genapi.registers import Registers
from fieldcam.camera.usb3vision.blocks import LEADER_BYTES, TRAILER_BYTES
from fieldcam.camera.usb3vision.bootstrap import Sirm, write_u32
from fieldcam.camera.usb3vision.transport import MAX_PACKET_BYTES, round_up
from fieldcam.errors import CameraUnsupported

LARGEST_TRANSFER_BYTES = 1 << 20
"""Far below the 16 MiB that usbfs grants to all transfers of a machine."""
LARGEST_PAYLOAD_BYTES = 256 << 20
_LARGEST_LEADER_BYTES = 64 << 10

_CONTROL = 0x04
_SIZES = 0x18


@dataclass(frozen=True, slots=True)
class TransferPlan:
    """Lengths in bytes, as the camera is told them."""

    leader: int
    trailer: int
    payload: int
    """Of each of the equal transfers."""
    payload_count: int
    final: int
    """Of the transfer with the rest; 0 where there is none."""

    @property
    def windows(self) -> tuple[int, ...]:
        """What is read for each transfer of a block's data: whole packets."""
        rest = (round_up(self.final, MAX_PACKET_BYTES),) if self.final else ()
        return (self.payload,) * self.payload_count + rest

    @property
    def capacity(self) -> int:
        """Of the memory for one block's data."""
        return sum(self.windows)


def plan_transfers(sirm: Sirm, largest_transfer: int = LARGEST_TRANSFER_BYTES) -> TransferPlan:
    """Raises CameraUnsupported where the camera asks for what cannot be."""
    if not 1 <= sirm.payload_bytes <= LARGEST_PAYLOAD_BYTES:
        raise CameraUnsupported(f"The camera wants to send pictures of {sirm.payload_bytes} bytes.")
    if max(sirm.leader_bytes, sirm.trailer_bytes) > _LARGEST_LEADER_BYTES:
        raise CameraUnsupported("The camera wants to send more about a picture than can be.")
    unit = max(sirm.alignment_bytes, MAX_PACKET_BYTES)
    payload = max(unit, largest_transfer - largest_transfer % unit)
    count, rest = divmod(sirm.payload_bytes, payload)
    return TransferPlan(
        round_up(max(sirm.leader_bytes, LEADER_BYTES), sirm.alignment_bytes),
        round_up(max(sirm.trailer_bytes, TRAILER_BYTES), sirm.alignment_bytes),
        payload,
        count,
        round_up(rest, sirm.alignment_bytes),
    )


def write_plan(registers: Registers, sirm: Sirm, plan: TransferPlan) -> None:
    """Tell the camera; the stream must be off."""
    layout = (plan.leader, plan.payload, plan.payload_count, plan.final, 0, plan.trailer)
    for index, value in enumerate(layout):
        write_u32(registers, sirm.address + _SIZES + 4 * index, value)


def enable_stream(registers: Registers, sirm_address: int) -> None:
    """From now on the camera sends its blocks by the plan it was told."""
    write_u32(registers, sirm_address + _CONTROL, 1)


def disable_stream(registers: Registers, sirm_address: int) -> None:
    """The plan may be written while the stream is off."""
    write_u32(registers, sirm_address + _CONTROL, 0)
