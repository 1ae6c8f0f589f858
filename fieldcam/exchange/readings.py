"""A ClusterReading as JSON and back.

What comes back differs from what went in by at most 1/128 px of disparity and
0.005 mm of a cloud. `schema` counts the versions of this form: an older one is
brought up to date when it is read, a newer one is refused.
"""

from __future__ import annotations

import binascii
import json
import zlib
from collections.abc import Mapping
from typing import Any

from fieldcam.errors import ReadingInvalid
from fieldcam.exchange.json_fields import Json, is_whole, number, optional, text, truth, whole
from fieldcam.exchange.reading_parts import (
    decode_calibration,
    decode_fruitlet,
    decode_tag,
    decode_verdict,
    decode_window,
    encode_calibration,
    encode_fruitlet,
    encode_tag,
    encode_verdict,
    encode_window,
)
from fieldcam.values import (
    READING_SCHEMA_VERSION,
    ClusterReading,
    Expectation,
    Matcher,
    Method,
    Settings,
)


def dump_reading(reading: ClusterReading) -> str:
    """The reading as one line of JSON."""
    return json.dumps(encode_reading(reading), separators=(",", ":"), allow_nan=False)


def load_reading(text: str) -> ClusterReading:
    """The reading in a JSON text."""
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ReadingInvalid("The stored reading is damaged: it is no JSON.") from error
    return decode_reading(document)


def encode_reading(reading: ClusterReading) -> Json:
    """The reading as values that JSON knows."""
    return {
        "schema": READING_SCHEMA_VERSION,
        "software_version": reading.software_version,
        "models": dict(reading.models),
        "timing_ms": {stage: float(ms) for stage, ms in reading.timing_ms.items()},
        "calibration": encode_calibration(reading.calibration),
        "settings": {
            "method": reading.settings.method.value,
            "stereo": reading.settings.stereo.value,
            "whole_image": reading.settings.whole_image,
            "tag_size_mm": float(reading.settings.tag_size_mm),
        },
        "expectation": {
            "tag_id": reading.expectation.tag_id,
            "fruitlets": reading.expectation.fruitlets,
        },
        "tag": None if reading.tag is None else encode_tag(reading.tag),
        "tags_seen": [int(tag_id) for tag_id in reading.tags_seen],
        "verdict": encode_verdict(reading.verdict),
        "fruitlets": [encode_fruitlet(fruitlet) for fruitlet in reading.fruitlets],
        "faint_px": [[float(x), float(y)] for x, y in reading.faint_px],
        "unsure_px": [[float(x), float(y)] for x, y in reading.unsure_px],
        **_known({"tag_size_error": reading.tag_size_error}),
        "window": None if reading.window is None else encode_window(reading.window),
    }


def _known(parts: Mapping[str, float | None]) -> Json:
    """What early versions did not write is left out where it is not known."""
    return {name: float(value) for name, value in parts.items() if value is not None}


def decode_reading(document: object) -> ClusterReading:
    """The reading in a JSON document; its schema version is the present one."""
    if not isinstance(document, Mapping) or not is_whole(document.get("schema")):
        raise ReadingInvalid("This is no stored reading.")
    if document["schema"] > READING_SCHEMA_VERSION:
        raise ReadingInvalid(
            f"The reading was stored by a newer fieldcam (form {document['schema']};"
            f" this one knows forms up to {READING_SCHEMA_VERSION}).",
            "Update fieldcam on this machine.",
        )
    try:
        return _decode_reading(document)
    except (
        AttributeError,
        KeyError,
        OverflowError,
        TypeError,
        ValueError,
        binascii.Error,
        zlib.error,
    ) as error:
        raise ReadingInvalid("The stored reading is damaged.") from error


def _decode_reading(d: Mapping[str, Any]) -> ClusterReading:
    settings, expectation = d["settings"], d["expectation"]
    return ClusterReading(
        tag=optional(d["tag"], decode_tag),
        tags_seen=tuple(whole(tag_id) for tag_id in d["tags_seen"]),
        fruitlets=tuple(decode_fruitlet(fruitlet) for fruitlet in d["fruitlets"]),
        verdict=decode_verdict(d["verdict"]),
        window=optional(d["window"], decode_window),
        calibration=decode_calibration(d["calibration"]),
        settings=Settings(
            method=Method(settings["method"]),
            stereo=Matcher(settings["stereo"]),
            whole_image=truth(settings["whole_image"]),
            tag_size_mm=number(settings["tag_size_mm"]),
        ),
        expectation=Expectation(
            tag_id=optional(expectation["tag_id"], whole),
            fruitlets=optional(expectation["fruitlets"], whole),
        ),
        faint_px=tuple((number(x), number(y)) for x, y in d.get("faint_px", ())),
        unsure_px=tuple((number(x), number(y)) for x, y in d.get("unsure_px", ())),
        tag_size_error=optional(d.get("tag_size_error"), number),
        timing_ms={text(stage): number(ms) for stage, ms in d["timing_ms"].items()},
        models={text(role): text(digest) for role, digest in d["models"].items()},
        software_version=text(d["software_version"]),
        schema_version=READING_SCHEMA_VERSION,
    )
