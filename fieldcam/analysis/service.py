"""Answers the app's requests, inside the analysis process."""

from __future__ import annotations

import importlib
import traceback
from pathlib import Path
from typing import Protocol

from fieldcam.analysis.frames import frame
from fieldcam.analysis.replies import Done, Failed, Read, Reply, Seen, encode_reply
from fieldcam.analysis.requests import Analyse, Look, Ping, Request, Setup, WarmUp
from fieldcam.errors import AnalysisFailed, FieldcamError
from fieldcam.store.captures import SavedCapture
from fieldcam.values import ClusterReading, Expectation, TagPose


class Work(Protocol):
    """What WORK names: a class that takes a Setup and has these methods."""

    def warm_up(self) -> None: ...

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading: ...

    def look(self, image: Path, shrunk: int, calibration: Path | None) -> tuple[TagPose, ...]: ...


class Service:
    """Answers requests by what a class of this dotted name (`module:Class`) does."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._setup: Setup | None = None
        self._work: Work | None = None

    def answer(self, request: Request) -> bytes:
        """The reply's frame; no error leaves this but by it."""
        try:
            return frame(encode_reply(self._reply(request)))
        except FieldcamError as error:
            return frame(encode_reply(Failed(error)))
        except Exception as error:  # the process edge: nobody above can tell the operator
            traceback.print_exc()
            sentence = f"The analysis failed on this: {type(error).__name__}: {error}."
            hint = "The picture is kept. Please report this with the analysis log."
            return frame(encode_reply(Failed(AnalysisFailed(sentence, hint))))

    def _reply(self, request: Request) -> Reply:
        match request:
            case WarmUp(setup):
                self._setup, self._work = setup, None
                self._opened().warm_up()
            case Analyse(saved, expectation):
                return Read(self._opened().analyse(saved, expectation))
            case Look(image, shrunk, calibration):
                return Seen(self._opened().look(image, shrunk, calibration))
            case Ping():
                pass
        return Done()

    def _opened(self) -> Work:
        """Opened again with each request until it once succeeds."""
        if self._work is None:
            module, _, name = self._name.partition(":")
            work: Work = getattr(importlib.import_module(module), name)(self._setup)
            self._work = work
        return self._work
