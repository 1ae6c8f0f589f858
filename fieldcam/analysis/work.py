"""What the analysis process does; the app's own process never imports this."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np

from fieldcam.analysis.direct import DirectAnalyst
from fieldcam.analysis.requests import Setup
from fieldcam.calibration.cameras import own_camera
from fieldcam.disk.raw_images import decode_raw
from fieldcam.errors import ImageUnreadable
from fieldcam.models import find_models, verify_model
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Calibration, ClusterReading, Expectation, StereoPair, TagPose
from fieldcam.vision.pipeline import Pipeline
from fieldcam.vision.tags.detection import detect_tags

_SMALL = Calibration(320, 240, 380.0, 160.0, 120.0, 60.0)


class VisionWork:
    """Reads saved pairs; networks and rectification maps are made once and kept."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup

    def warm_up(self) -> None:
        """Both networks open with the first pair, so give them a small one."""
        grey = np.full((_SMALL.height_px, _SMALL.width_px, 3), 90, np.uint8)
        self._pipeline.analyse(StereoPair(grey, grey), _SMALL, settings=self._setup.settings)
        _ = self._analyst

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading:
        return self._analyst.analyse(saved, expectation)

    def look(
        self, image: Path, shrunk: int, calibration: Path | None = None
    ) -> tuple[TagPose, ...]:
        """The tags of a preview; of a raw camera's, its distortion is left as it is."""
        try:
            content = image.read_bytes()
        except OSError as error:
            raise ImageUnreadable(f"The preview cannot be read: {error.strerror}.") from error
        pixels = decode_raw(content, image.name)
        size_px = pixels.shape[1] * shrunk, pixels.shape[0] * shrunk
        camera = _described(calibration or self._setup.camera, size_px)
        own = None if camera is None else _shrunk(camera, shrunk)
        return detect_tags(pixels, own, self._setup.settings.tag_size_mm)

    @functools.cached_property
    def _pipeline(self) -> Pipeline:
        models = find_models(self._setup.data)
        for model in models.files:
            verify_model(model)
        return Pipeline.from_models(models)

    @functools.cached_property
    def _analyst(self) -> DirectAnalyst:
        return DirectAnalyst(self._pipeline, self._setup.camera, self._setup.settings)


def _described(camera: Calibration | Path | None, size_px: tuple[int, int]) -> Calibration | None:
    return own_camera(camera, size_px).calibration if isinstance(camera, Path) else camera


def _shrunk(camera: Calibration, times: int) -> Calibration:
    """The camera whose pixels are every so many of this one's, from the first on."""
    return replace(
        camera,
        width_px=camera.width_px // times,
        height_px=camera.height_px // times,
        focal_px=camera.focal_px / times,
        cx_px=camera.cx_px / times,
        cy_px=camera.cy_px / times,
    )
