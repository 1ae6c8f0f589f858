"""Analyses saved pairs in the calling process."""

from __future__ import annotations

from fieldcam.calibration.rectification import Rectifier, develop
from fieldcam.store.captures import SavedCapture, load_raw
from fieldcam.values import Calibration, ClusterReading, Expectation, Settings
from fieldcam.vision.pipeline import Pipeline


class DirectAnalyst:
    """Reads each pair back from the disk, so that what is analysed is what was saved."""

    def __init__(
        self,
        pipeline: Pipeline,
        calibration: Calibration,
        settings: Settings,
        rectifier: Rectifier | None = None,
    ) -> None:
        self._pipeline = pipeline
        self._calibration = calibration
        self._settings = settings
        self._rectifier = rectifier

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading:
        """The reading of one saved pair."""
        pair = develop(load_raw(saved))
        if self._rectifier is not None:
            pair = self._rectifier.rectify(pair)
        return self._pipeline.analyse(pair, self._calibration, expectation, self._settings)
