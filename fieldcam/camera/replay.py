"""A folder of captures behind the camera's port: recorded pairs come out in their order."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from types import TracebackType
from typing import Self

from fieldcam.errors import CameraUnplugged
from fieldcam.exchange.capture_folder import CaptureFile
from fieldcam.values import Calibration, PixelFormat, RawPair


class ReplayCamera:
    """Gives recorded pairs one after the other; unplugged when they are used up.

    The pairs count as rectified when `calibration` describes rectified images.
    """

    def __init__(self, captures: Sequence[CaptureFile], calibration: Calibration | None) -> None:
        self._captures = tuple(captures)
        self._calibration = calibration
        self._taken = 0

    @property
    def serials(self) -> tuple[str, str]:
        return "replay-left", "replay-right"

    @property
    def calibration(self) -> Calibration | None:
        return self._calibration

    def capture(self, deadline_s: float) -> RawPair:
        """The next recorded pair; reading it does not wait, so the deadline is always kept."""
        # Loads OpenCV, which the process that owns the camera must not do by importing this.
        from fieldcam.exchange.images import read_pair

        if self._taken >= len(self._captures):
            raise CameraUnplugged("The recording is over: all its pairs were replayed.")
        recorded = self._captures[self._taken]
        self._taken += 1
        left, right = read_pair(recorded.left, recorded.right)
        modified = datetime.fromtimestamp(recorded.left.stat().st_mtime, UTC)
        return RawPair(
            left=left,
            right=right,
            pixel_format=PixelFormat.RGB8,
            taken_at=modified,
            left_timestamp_ns=0,
            right_timestamp_ns=0,
            left_serial=self.serials[0],
            right_serial=self.serials[1],
            trigger_ordinal=self._taken,
        )

    def close(self) -> None:
        self._taken = len(self._captures)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
