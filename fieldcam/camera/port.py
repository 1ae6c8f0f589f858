"""What any stereo head must do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, Self

from fieldcam.camera.preview import Preview
from fieldcam.values import Calibration, RawPair

DEADLINE_S = 5.0
"""How long a triggered pair may take to arrive."""


class FlashStereoDevice(Protocol):
    """An open camera: two eyes and a flash, fired together.

    One thread uses it at a time. After `close` it takes no more pictures;
    closing twice is fine.
    """

    @property
    def serials(self) -> tuple[str, str]:
        """Serial numbers of the left and right eye."""
        ...

    @property
    def calibration(self) -> Calibration | None:
        """The rectified camera that the head itself describes, where it does."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence for each thing that is not as it should be, and stops no picture."""
        ...

    def capture(self, deadline_s: float) -> RawPair:
        """Fire once and give the pair.

        Raises CaptureTimeout when no whole pair came within `deadline_s`, CameraUnplugged
        when the camera is gone, and another DeviceError where the pair cannot be used: a
        damaged or unlit one is never handed on.
        """
        ...

    def preview(self, deadline_s: float) -> Preview | None:
        """What the left eye sees now, without the flash; None where it sees nothing yet.

        Raises as `capture` does. Costs nothing while nobody asks.
        """
        ...

    def attend(self) -> None:
        """Raise CameraUnplugged where it went while nobody used it; wakes nothing."""
        ...

    def watch_shutter(self, pressed: Callable[[], None]) -> None:
        """Call this whenever the camera's own shutter is pressed, from any thread."""
        ...

    def close(self) -> None:
        """Give the device back."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...
