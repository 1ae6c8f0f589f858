"""Answers the app's requests, inside the analysis process."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from fieldcam.analysis.messages import (
    Analyse,
    Answer,
    FindTags,
    Request,
    Setup,
    Tags,
    WarmUp,
    encode_reply,
    frame,
)
from fieldcam.errors import AnalysisFailed, FieldcamError
from fieldcam.store.captures import SavedCapture
from fieldcam.values import ClusterReading, Expectation


class Work(Protocol):
    """What is asked of the process."""

    def warm_up(self) -> None: ...

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading: ...

    def look(self, image: Path, shrunk: int, calibration: Path | None) -> Tags: ...


class Service:
    """Answers requests by what the work says."""

    def __init__(self, open_work: Callable[[Setup], Work]) -> None:
        self._open_work = open_work
        self._setup: Setup | None = None
        self._work: Work | None = None

    def answer(self, request: Request) -> bytes:
        """The reply's frame; no error leaves this but by it."""
        try:
            return frame(encode_reply(self._answer(request)))
        except FieldcamError as error:
            return frame(encode_reply(error))
        except Exception as error:  # the process edge: nobody above can tell the operator
            traceback.print_exc()
            sentence = f"The analysis failed on this: {type(error).__name__}: {error}."
            hint = "The picture is kept. Please report this with the analysis log."
            return frame(encode_reply(AnalysisFailed(sentence, hint)))

    def _answer(self, request: Request) -> Answer:
        match request:
            case WarmUp(setup):
                self._setup, self._work = setup, None
                self._opened().warm_up()
            case Analyse(saved, expectation):
                return self._opened().analyse(saved, expectation)
            case FindTags(image, shrunk, calibration):
                return self._opened().look(image, shrunk, calibration)
        return None

    def _opened(self) -> Work:
        """Opened again with each request until it once succeeds."""
        if self._work is None:
            assert self._setup is not None  # the app warms it up first
            self._work = self._open_work(self._setup)
        return self._work
