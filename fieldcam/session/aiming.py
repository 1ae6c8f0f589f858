"""Makes cues of previews: each is looked at by the analysis, unless that is busy."""

from __future__ import annotations

import threading
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Protocol

from fieldcam.camera.preview import Preview
from fieldcam.errors import FieldcamError
from fieldcam.session.aim.cue import Cue, cue_of
from fieldcam.session.aim.preview_file import PreviewFile
from fieldcam.session.calibrating import CameraCalibration
from fieldcam.session.events import Listener, Previewed
from fieldcam.values import TagPose

BUSY = "The analysis is busy."


class Looker(Protocol):
    """What finds tags in previews; `analysis.supervisor.Supervisor` is one."""

    def look(
        self, image: Path, shrunk: int, calibration: Path | None
    ) -> Future[tuple[TagPose, ...]]: ...


class Aiming:
    """`show` and `stop` are called in the camera's thread, the looker answers in its own."""

    def __init__(
        self,
        file: PreviewFile,
        looker: Looker,
        tell: Listener,
        calibration: CameraCalibration | None = None,
    ) -> None:
        """`calibration` goes with each preview, where the looker does not know the camera."""
        self._file, self._looker, self._tell = file, looker, tell
        self._calibration = calibration
        self._lock, self._live = threading.Lock(), False
        self._asked: Future[tuple[TagPose, ...]] | None = None
        self._last: Cue | None = None
        self.due: int | None = None
        """The tag that is due; set by whoever knows."""

    def show(self, preview: Preview) -> None:
        """Have it looked at; told with its cue, at once where there can be none."""
        self._live = True
        if self._asked is not None and not self._asked.done():
            self._told(preview, self._blind(preview, BUSY))
            return
        try:
            image = self._file.keep_image(preview.left)
        except OSError as error:
            sentence = f"The preview cannot be written: {error.strerror}."
            self._told(preview, self._blind(preview, sentence))
            return
        calibration = None if self._calibration is None else self._calibration.file
        self._asked = self._looker.look(image, preview.shrunk, calibration)
        self._asked.add_done_callback(partial(self._looked, preview))

    def stop(self) -> None:
        """Nobody aims any more."""
        with self._lock, suppress(OSError):
            self._live, self._last = False, None
            self._file.remove()

    def _looked(self, preview: Preview, done: Future[tuple[TagPose, ...]]) -> None:
        try:
            cue = cue_of(self.due, done.result(), self._last, preview.flash_ready)
        except CancelledError:
            cue = self._blind(preview, BUSY)
        except FieldcamError as error:
            cue = self._blind(preview, str(error))
        self._last = cue
        self._told(preview, cue)

    def _told(self, preview: Preview, cue: Cue) -> None:
        with self._lock, suppress(OSError):
            if not self._live:
                return  # the look took longer than the operator's interest in it
            # Screens elsewhere go without where it fails; this one is told in any case.
            self._file.keep_cue(cue)
        self._tell(Previewed(preview.left, cue))

    def _blind(self, preview: Preview, problem: str) -> Cue:
        return Cue(self.due, flash_ready=preview.flash_ready, problem=problem)
