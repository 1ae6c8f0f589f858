"""What the analysis process does; the app's own process never imports this."""

from __future__ import annotations

import functools

import numpy as np

from fieldcam.analysis.direct import DirectAnalyst
from fieldcam.analysis.requests import Setup
from fieldcam.models import find_models, verify_model
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Calibration, ClusterReading, Expectation, StereoPair
from fieldcam.vision.pipeline import Pipeline

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

    @functools.cached_property
    def _pipeline(self) -> Pipeline:
        models = find_models(self._setup.data)
        for model in models.files:
            verify_model(model)
        return Pipeline.from_models(models)

    @functools.cached_property
    def _analyst(self) -> DirectAnalyst:
        return DirectAnalyst(self._pipeline, self._setup.camera, self._setup.settings)
