"""Which left image belongs to which right one, for each way to carry a stereo pair. Pure.

Never by the order of arrival: two devices are paired by their corrected clocks, or by
their trigger ordinals where a clock is missing, and one device by its block ids.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from datetime import datetime
from enum import Enum, StrEnum

from fieldcam.camera.usb3vision.clocks import DeviceClock
from fieldcam.errors import CameraUnsupported, PairMismatch
from fieldcam.values import ImageU8, PixelFormat, RawPair

MAX_WAITING = 4
"""Images of one eye whose other half has not come; more of them are never paired."""


class Eye(StrEnum):
    LEFT = "left"
    RIGHT = "right"


class EyeLayout(Enum):
    """Where both eyes lie in one image; the left one comes first."""

    SIDE_BY_SIDE = 1
    STACKED = 0


@dataclass(frozen=True, slots=True, eq=False)
class Half:
    """What one eye saw of one exposure."""

    image: ImageU8
    pixel_format: PixelFormat
    block_id: int
    device_time_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class EyePair:
    """Both eyes' images of the same exposure."""

    left: Half
    right: Half


class TwinPairing:
    """Pairs the images of two devices that one trigger fires.

    Clocks decide where both are known: a device that missed a trigger does not count
    it, so its block ids then lag behind by one for good. Without clocks the ids decide,
    from the first image of each device on; the owner then restarts after any loss.
    """

    def __init__(self, tolerance_ns: int) -> None:
        """`tolerance_ns`: less than half the time between two exposures."""
        self._tolerance_ns = tolerance_ns
        self.clocks: dict[Eye, DeviceClock] = {}
        self.dropped = 0
        """Halves that stayed alone."""
        self.restart()

    def restart(self) -> None:
        """Forget counts and halves: the streams were armed anew."""
        self._waiting: dict[Eye, deque[Half]] = {eye: deque() for eye in Eye}
        self._last_id: dict[Eye, int] = {}
        self._shift: int | None = None

    def add(self, eye: Eye, half: Half) -> EyePair | None:
        """Take in an image; gives the pair that it completes."""
        if half.block_id <= self._last_id.get(eye, -1):
            self.dropped += sum(map(len, self._waiting.values()))
            self.restart()
        self._last_id[eye] = half.block_id
        self._waiting[eye].append(half)
        left, right = self._waiting[Eye.LEFT], self._waiting[Eye.RIGHT]
        while left and right:
            order = self._order(left[0], right[0])
            if order == 0:
                return EyePair(left.popleft(), right.popleft())
            self._drop(left if order < 0 else right)
        if len(self._waiting[eye]) > MAX_WAITING:
            self._drop(self._waiting[eye])
        return None

    def _order(self, left: Half, right: Half) -> int:
        """Negative where the left image is the older one, 0 where both belong together."""
        if len(self.clocks) == len(Eye):
            apart_ns = self._apart_ns(left, right)
            return 0 if abs(apart_ns) <= self._tolerance_ns else apart_ns
        shift = left.block_id - right.block_id
        if self._shift is None:
            self._shift = shift
        return shift - self._shift

    def _apart_ns(self, left: Half, right: Half) -> int:
        """Host time from the right exposure to the left one."""
        left_ns = self.clocks[Eye.LEFT].to_host_ns(left.device_time_ns)
        return left_ns - self.clocks[Eye.RIGHT].to_host_ns(right.device_time_ns)

    def _drop(self, waiting: deque[Half]) -> None:
        waiting.popleft()
        self.dropped += 1


class ComponentPairing:
    """Pairs the two images that one device sends of each exposure."""

    def __init__(self) -> None:
        self._waiting: tuple[int, Eye, Half] | None = None
        self.dropped = 0

    def add(self, exposure: int, eye: Eye, half: Half) -> EyePair | None:
        """Take in an image of this exposure, which both halves name alike."""
        waiting, self._waiting = self._waiting, (exposure, eye, half)
        if waiting is None:
            return None
        if waiting[:2] != (exposure, _other(eye)):
            self.dropped += 1
            return None
        self._waiting = None
        return EyePair(waiting[2], half) if eye is Eye.RIGHT else EyePair(half, waiting[2])


class AlternatePairing:
    """Pairs one device's blocks that hold left and right in turn, left first."""

    def __init__(self, first_id: int) -> None:
        """`first_id`: the block id with which the device begins, 0 or 1."""
        self._first_id = first_id
        self._components = ComponentPairing()

    @property
    def dropped(self) -> int:
        return self._components.dropped

    def add(self, half: Half) -> EyePair | None:
        """Take in a block; gives the pair that it completes."""
        exposure, place = divmod(half.block_id - self._first_id, 2)
        return self._components.add(exposure, tuple(Eye)[place], half)


def split(half: Half, layout: EyeLayout) -> EyePair:
    """Both eyes of one image, as views; raises CameraUnsupported where it has no middle."""
    length = half.image.shape[layout.value]
    # Half of a Bayer mosaic must begin with the same colour as the whole.
    step = 2 if half.pixel_format in (PixelFormat.RGB8, PixelFormat.MONO8) else 4
    if length % step:
        raise CameraUnsupported(f"A picture of two eyes cannot be {length} pixels long.")
    middle = length // 2
    first, second = (
        (half.image[:, :middle], half.image[:, middle:])
        if layout is EyeLayout.SIDE_BY_SIDE
        else (half.image[:middle], half.image[middle:])
    )
    return EyePair(replace(half, image=first), replace(half, image=second))


def raw_pair(
    pair: EyePair, taken_at: datetime, serials: tuple[str, str], trigger_ordinal: int
) -> RawPair:
    """The pair as the store and the analysis take it; no pixel is copied."""
    left, right = pair.left, pair.right
    if (left.image.shape, left.pixel_format) != (right.image.shape, right.pixel_format):
        raise PairMismatch(
            "Left and right camera send pictures of different size or pixel format.",
            "Set both alike.",
        )
    return RawPair(
        left=left.image,
        right=right.image,
        pixel_format=left.pixel_format,
        taken_at=taken_at,
        left_timestamp_ns=left.device_time_ns,
        right_timestamp_ns=right.device_time_ns,
        left_serial=serials[0],
        right_serial=serials[1],
        trigger_ordinal=trigger_ordinal,
    )


def _other(eye: Eye) -> Eye:
    return Eye.RIGHT if eye is Eye.LEFT else Eye.LEFT
