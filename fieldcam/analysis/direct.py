"""Analyses saved pairs in the calling process."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fieldcam.calibration.cameras import Camera, open_camera, own_camera
from fieldcam.calibration.rectification import develop
from fieldcam.disk.image_headers import RAW_SUFFIXES
from fieldcam.disk.raw_images import decode_raw
from fieldcam.errors import CalibrationInvalid
from fieldcam.exchange.holes import torn_eyes
from fieldcam.exchange.images import decode_image
from fieldcam.store.captures import SavedCapture, load_raw
from fieldcam.store.queries.lookups import cards_of
from fieldcam.values import Calibration, ClusterReading, Expectation, ImageU8, Settings
from fieldcam.vision.pipeline import Pipeline


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
