"""Reads every stored picture that has no reading, of all blocks and days."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from fieldcam.errors import ReadingDamaged
from fieldcam.session.calibrating import OwnCalibration
from fieldcam.session.events import AnalysisTrouble
from fieldcam.session.reading import Keeping, Reader
from fieldcam.session.viewing import WalkView
from fieldcam.store.connection import rows
from fieldcam.store.folder import DataKind
from fieldcam.store.queries.resuming import Waiting, waiting_for_analysis
from fieldcam.store.readings import stored_reading
from fieldcam.store.store import Store
from fieldcam.values import Calibration, Expectation


@dataclass(frozen=True, slots=True)
class CaughtUp:
    """What became of one picture."""

    tag_id: int | None
    problem: str = ""
    """Why it has no reading still."""


def catch_up(store: Store, reader: Reader) -> Iterator[CaughtUp]:
    """One outcome for each. Nothing is decided: whoever decided before may have said no.

    Of a head in the field the calibration in use stands in where a picture has none.
    """
    own = OwnCalibration(store) if store.folder.kind is DataKind.FIELD else None
    for picture in waiting_for_analysis(store.database):
        saved = picture.saved if own is None else own.completed(picture.saved)
        if own is not None and saved is None:
            yield CaughtUp(picture.tag_expected, own.problem)
        if saved is None:
            continue
        view = None if picture.visit is None else WalkView(store, picture.visit)
        keeping = Keeping(store, view, once=True)
        event = keeping.read(reader, saved, _expectation(view, picture))
        problem = event.error.message if isinstance(event, AnalysisTrouble) else ""
        yield CaughtUp(picture.tag_expected, problem)


def simulated_camera(store: Store) -> Calibration | None:
    """That of the newest sound reading, for simulated pictures, all of which are rectified.

    An early version kept no calibration with them.
    """
    if store.folder.kind is not DataKind.SIMULATED:
        return None
    sql = "SELECT id FROM reading JOIN standing USING (id) ORDER BY turn DESC"
    for row in rows(store.database, sql):
        with suppress(ReadingDamaged):
            return stored_reading(store.database, row["id"]).calibration
    return None


def _expectation(view: WalkView | None, picture: Waiting) -> Expectation:
    if view is None:
        return Expectation(picture.tag_expected)
    return view.expectation(picture.tag_expected)
