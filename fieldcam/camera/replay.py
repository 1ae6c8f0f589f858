"""The pairs of a recorded folder, for a camera that is aimed at their tags."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fieldcam.camera.aimed import Wanted
from fieldcam.camera.beside import PictureProcess
from fieldcam.exchange.capture_folder import CaptureFile
from fieldcam.values import Calibration, PixelFormat, RawPair

SERIALS = ("replay-left", "replay-right")


class ReplayProcess(PictureProcess):
    """Decodes recorded pairs beside the app."""

    def __init__(self) -> None:
        super().__init__(_prepare)
        self.about(bool)


class RecordedDay:
    """What an aimed camera takes on one recorded day; after the last view the first comes again."""

    def __init__(self, process: PictureProcess, captures: Sequence[CaptureFile]) -> None:
        """`captures` are those of the day, by tag and view."""
        self._process = process
        self._views: dict[int, list[CaptureFile]] = {}
        for capture in captures:
            self._views.setdefault(capture.tag_id, []).append(capture)

    @property
    def serials(self) -> tuple[str, str]:
        return SERIALS

    @property
    def calibration(self) -> Calibration | None:
        """The recording's own file describes the camera; only the analysis reads it."""
        return None

    @property
    def tag_ids(self) -> tuple[int, ...]:
        return tuple(self._views)

    def make(self, wanted: Wanted) -> RawPair:
        views = self._views[wanted.tag_id]
        return self._process.picture(views[wanted.view % len(views)])


def _prepare() -> tuple[bool, Callable[[CaptureFile], RawPair]]:
    return True, read_recorded


def read_recorded(capture: CaptureFile) -> RawPair:
    """The pair of two image files; loads OpenCV, which the app's own process must not."""
    from fieldcam.exchange.images import read_pair

    left, right = read_pair(capture.left, capture.right)
    return RawPair(
        left=left,
        right=right,
        pixel_format=PixelFormat.RGB8,
        taken_at=capture.local_time,
        left_timestamp_ns=0,
        right_timestamp_ns=0,
        left_serial=SERIALS[0],
        right_serial=SERIALS[1],
        trigger_ordinal=capture.view,
    )
