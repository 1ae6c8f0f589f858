"""Readings in and out of the database."""

from __future__ import annotations

from typing import Any

from sqlite_utils import Database

from fieldcam.codec.forms import FruitletForm
from fieldcam.codec.readings import EncodedReading, load_reading
from fieldcam.errors import ReadingInvalid
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.rows.row import EntryId
from fieldcam.store.rows.walk import Reading
from fieldcam.store.seals import damaged, sealed_document
from fieldcam.values import ClusterReading


def reading_row(capture: EntryId, reading: EncodedReading, duration_ms: float) -> Reading:
    """The row of a reading that took this long since its capture was saved."""
    form = reading.form
    return Reading(
        capture=capture,
        document=reading.text,
        schema_version=form.schema,
        tag_read=None if form.tag is None else form.tag.id,
        status=form.verdict.status.value,
        reasons=tuple(reason.code.value for reason in form.verdict.reasons),
        target_count=len(form.target),
        sizes=tuple(_size(fruitlet) for fruitlet in form.fruitlets),
        models=form.models,
        method=form.settings.method.value,
        stereo=form.settings.stereo.value,
        software_version=form.software_version,
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


def _size(fruitlet: FruitletForm) -> dict[str, Any]:
    x_px, y_px = fruitlet.center_px
    return {
        "id": fruitlet.id,
        "in_target": fruitlet.in_target,
        "cluster": fruitlet.cluster,
        "diameter_mm": fruitlet.diameter_mm,
        "sd_mm": fruitlet.sd_mm,
        "x_px": x_px,
        "y_px": y_px,
        "area_px": fruitlet.mask.area_px,
    }
