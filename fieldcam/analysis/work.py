"""What the analysis process does; the app's own process never imports this."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np

from fieldcam.analysis.messages import Setup
from fieldcam.calibration.cameras import Camera, open_camera, own_camera
from fieldcam.calibration.rectification import develop
from fieldcam.disk.image_headers import RAW_SUFFIXES
from fieldcam.disk.raw_images import decode_raw
from fieldcam.errors import CalibrationInvalid, ImageUnreadable
from fieldcam.exchange.holes import torn_eyes
from fieldcam.exchange.images import decode_image
from fieldcam.models import find_models, verify_model
from fieldcam.store.captures import SavedCapture, load_raw
from fieldcam.store.queries.lookups import cards_of
from fieldcam.values import (
    Calibration,
    ClusterReading,
    Expectation,
    ImageU8,
    Settings,
    StereoPair,
    TagPose,
)
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


class DirectAnalyst:
    """Reads each pair back from the disk, so that what is analysed is what was saved."""

    def __init__(
        self, pipeline: Pipeline, camera: Calibration | Path | None, settings: Settings
    ) -> None:
        """`camera` took the pairs that come without a calibration of their own."""
        self._pipeline = pipeline
        self._camera = None if camera is None else open_camera(camera)
        self._settings = settings

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading:
        """The reading of one saved pair."""
        raw = load_raw(saved, decode_stored)
        files = {"left": (saved.left, raw.left), "right": (saved.right, raw.right)}
        pair = replace(develop(raw), torn=torn_eyes(files))
        camera = self._camera_of(saved, pair.size_px)
        pair = camera.rectify(pair)
        settings = self._settings_of(saved)
        return self._pipeline.analyse(pair, camera.calibration, expectation, settings)

    def _settings_of(self, saved: SavedCapture) -> Settings:
        """The cards are those of the picture's block."""
        size_mm = cards_of(saved.record, saved.key)
        return self._settings if size_mm is None else replace(self._settings, tag_size_mm=size_mm)

    def _camera_of(self, saved: SavedCapture, size_px: tuple[int, int]) -> Camera:
        if saved.calibration is not None:
            return own_camera(saved.calibration, size_px)
        if self._camera is None:
            raise CalibrationInvalid(
                "The picture came without a calibration.",
                "Calibrate the camera: `fieldcam calibrate`.",
            )
        return self._camera


def decode_stored(content: bytes, name: str) -> ImageU8:
    """The image of any file that the store keeps: a camera's raw one, or an imported one."""
    decode = decode_raw if name.endswith(RAW_SUFFIXES) else decode_image
    return decode(content, name)
