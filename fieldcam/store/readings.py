"""Readings in and out of the database."""

from __future__ import annotations

from typing import Any

from sqlite_utils import Database

from fieldcam.errors import ReadingInvalid
from fieldcam.exchange.readings import dump_reading, load_reading
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.walk import Reading
from fieldcam.store.seals import damaged, sealed_document
from fieldcam.values import ClusterReading, Fruitlet


def reading_row(capture: EntryId, reading: ClusterReading, duration_ms: float) -> Reading:
    """The row of a reading that took this long since its capture was saved."""
    return Reading(
        capture=capture,
        document=dump_reading(reading),
        schema_version=reading.schema_version,
        tag_read=None if reading.tag is None else reading.tag.id,
        status=reading.verdict.status.value,
        reasons=tuple(reason.code.value for reason in reading.verdict.reasons),
        target_count=len(reading.target),
        sizes=tuple(_size(fruitlet) for fruitlet in reading.fruitlets),
        models=dict(reading.models),
        method=reading.settings.method.value,
        stereo=reading.settings.stereo.value,
        software_version=reading.software_version,
        duration_ms=duration_ms,
    )


def stored_reading(database: Database, key: EntryId) -> ClusterReading:
    """A whole reading, with masks, clouds and disparity.

    Raises ReadingDamaged where it is not what was written.
    """
    document = sealed_document(database, key)
    try:
        return load_reading(document)
    except ReadingInvalid as error:
        if row_of(database, "reading", key)["sha256"] is None:
            raise damaged(database, key) from error
        raise


def _size(fruitlet: Fruitlet) -> dict[str, Any]:
    x_px, y_px = fruitlet.center_px
    diameter_mm = fruitlet.diameter_mm
    return {
        "id": fruitlet.id,
        "in_target": fruitlet.in_target,
        "cluster": fruitlet.cluster,
        "diameter_mm": None if diameter_mm is None else float(diameter_mm),
        "x_px": float(x_px),
        "y_px": float(y_px),
        "area_px": fruitlet.mask.area_px,
    }
