"""Reads every stored picture that has no reading, of all blocks and days."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from time import perf_counter

from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import AnalysisOff, FieldcamError, ReadingDamaged
from fieldcam.session.calibrating import OwnCalibration
from fieldcam.session.deciding.learning import learned
from fieldcam.session.viewing import WalkView, expected_at
from fieldcam.session.walk import Analyst
from fieldcam.store.connection import rows
from fieldcam.store.folder import DataKind
from fieldcam.store.queries.imports import failed_alike
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.queries.resuming import Waiting, waiting_for_analysis
from fieldcam.store.readings import reading_row, stored_reading
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.row import Row
from fieldcam.store.rows.walk import AnalysisFailure
from fieldcam.store.store import Store
from fieldcam.values import Calibration, Expectation, Status


@dataclass(frozen=True, slots=True)
class CaughtUp:
    """What became of one picture."""

    tag_id: int | None
    problem: str = ""
    """Why it has no reading still."""


def catch_up(store: Store, analyst: Analyst) -> Iterator[CaughtUp]:
    """One outcome for each; an imported picture without a doubt is accepted, as by an import.

    Of a head in the field the calibration in use stands in where a picture has none.
    """
    own = OwnCalibration(store) if store.folder.kind is DataKind.FIELD else None
    for picture in waiting_for_analysis(store.database):
        saved = picture.saved if own is None else own.completed(picture.saved)
        if own is not None and saved is None:
            yield CaughtUp(picture.tag_expected, own.problem)
        if saved is None:
            continue
        started = perf_counter()
        try:
            reading = analyst.analyse(saved, _expectation(store, picture))
        except AnalysisOff:
            raise
        except FieldcamError as error:
            _keep_failure(store, picture, error)
            yield CaughtUp(picture.tag_expected, error.message)
            continue
        duration_ms = (perf_counter() - started) * 1000
        store.append(
            reading_row(picture.saved.key, reading, duration_ms),
            *_learned(store, picture, reading),
            *_accepted(store, picture, reading),
        )
        yield CaughtUp(picture.tag_expected)


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


def _expectation(store: Store, picture: Waiting) -> Expectation:
    if picture.visit is None:
        return Expectation(picture.tag_expected)
    return expected_at(store.database, picture.visit, picture.tag_expected)


def _learned(store: Store, picture: Waiting, reading: EncodedReading) -> tuple[Row, ...]:
    if picture.visit is None:
        return ()
    return tuple(learned(WalkView(store, picture.visit), picture.saved.key, reading))


def _accepted(store: Store, picture: Waiting, reading: EncodedReading) -> tuple[Row, ...]:
    capture = row_of(store.database, "capture", picture.saved.key)
    decided = row_of(store.database, "capture_now", picture.saved.key)["decision"]
    if capture["source"] is None or decided or reading.verdict.status is not Status.ACCEPT:
        return ()
    return (Decision(picture.saved.key, Action.ACCEPT),)


def _keep_failure(store: Store, picture: Waiting, error: FieldcamError) -> None:
    """Once, however often it is tried."""
    key, cause = picture.saved.key, type(error).__name__
    if not failed_alike(store.database, key, cause, error.message):
        store.append(AnalysisFailure(key, cause, error.message))
