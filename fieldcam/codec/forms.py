"""The stored form of a reading, declared: the names, kinds and order of its JSON.

A name that early versions did not write has a default here, which says that it is not
known; every other has to be there. `value` makes what the rest of fieldcam works with.
"""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any, Self

import msgspec
import numpy as np

from fieldcam.codec import packing
from fieldcam.values import (
    READING_SCHEMA_VERSION,
    Calibration,
    ClusterReading,
    DisparityWindow,
    Ellipse,
    Expectation,
    Flag,
    Fruitlet,
    Mask,
    Matcher,
    Method,
    Reason,
    Region,
    Settings,
    Status,
    TagPose,
    Verdict,
)

XY = tuple[float, float]
XYZ = tuple[float, float, float]


class Form(msgspec.Struct, frozen=True, eq=False):
    """A JSON object; names that it does not declare are passed over."""


def dump_form(form: msgspec.Struct) -> str:
    """One line of ASCII; raises ValueError for NaN and infinity, which JSON does not know."""
    document = msgspec.to_builtins(form, enc_hook=_plain)
    return json.dumps(document, separators=(",", ":"), allow_nan=False)


def _plain(value: object) -> object:
    """Numpy's numbers are none to JSON."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no form in JSON")


class TagForm(Form, frozen=True):
    id: int
    center_px: XY
    corners_px: tuple[XY, XY, XY, XY]
    translation_mm: XYZ | None
    rotation: tuple[XYZ, XYZ, XYZ] | None
    decision_margin: float

    @classmethod
    def of(cls, tag: TagPose) -> Self:
        return cls(**_fields(tag))

    def value(self) -> TagPose:
        return TagPose(**_parts(self))


class VerdictForm(Form, frozen=True):
    status: Status
    reasons: tuple[Reason, ...]

    def value(self) -> Verdict:
        return Verdict(self.status, self.reasons)


class SettingsForm(Form, frozen=True):
    method: Method
    stereo: Matcher
    whole_image: bool
    tag_size_mm: float

    def value(self) -> Settings:
        return Settings(**_parts(self))


class ExpectationForm(Form, frozen=True):
    tag_id: int | None
    fruitlets: int | None

    def value(self) -> Expectation:
        return Expectation(self.tag_id, self.fruitlets)


class MaskForm(Form, frozen=True):
    x0: int
    y0: int
    width: int
    height: int
    runs: list[int]
    """As `packing.encode_mask` gives them."""

    @classmethod
    def of(cls, mask: Mask) -> Self:
        height, width = mask.window.shape
        runs = packing.encode_mask(mask.window)
        return cls(x0=mask.x0, y0=mask.y0, width=width, height=height, runs=runs)

    @property
    def area_px(self) -> int:
        return sum(self.runs[1::2])

    def value(self) -> Mask:
        return Mask(self.x0, self.y0, packing.decode_mask(self.runs, self.width, self.height))


class WindowForm(Form, frozen=True):
    x0: int
    y0: int
    width: int
    height: int
    lowest_px: float
    steps_per_px: float
    steps: str
    """As `packing.encode_disparity` gives them."""

    @classmethod
    def of(cls, window: DisparityWindow) -> Self:
        packed = packing.encode_disparity(window.disparity_px)
        return cls(x0=window.region.x0, y0=window.region.y0, **packed)

    def value(self) -> DisparityWindow:
        region = Region(self.x0, self.y0, self.x0 + self.width, self.y0 + self.height)
        disparity_px = packing.decode_disparity(
            self.steps, self.width, self.height, self.lowest_px, self.steps_per_px
        )
        return DisparityWindow(region, disparity_px)


class FruitletForm(Form, frozen=True, kw_only=True):
    id: int
    in_target: bool
    diameter_mm: float | None
    sd_mm: float | None = None
    center_px: XY
    box_px: tuple[float, float, float, float]
    score: float
    disparity_px: float | None
    range_mm: float | None
    visible_fraction: float
    flags: tuple[Flag, ...]
    mask: MaskForm
    outline: Ellipse | None
    cluster: int | None
    centroid_mm: XYZ | None
    cloud_points: int
    cloud: str
    """As `packing.encode_cloud` gives it."""

    @classmethod
    def of(cls, fruitlet: Fruitlet) -> Self:
        parts = _fields(fruitlet)
        cloud_mm = parts.pop("cloud_mm")
        packed = {"cloud_points": len(cloud_mm), "cloud": packing.encode_cloud(cloud_mm)}
        return cls(**parts | packed | {"mask": MaskForm.of(fruitlet.mask)})

    def value(self) -> Fruitlet:
        parts = _parts(self)
        cloud_mm = packing.decode_cloud(parts.pop("cloud"), parts.pop("cloud_points"))
        return Fruitlet(**parts | {"mask": self.mask.value(), "cloud_mm": cloud_mm})


class ReadingForm(Form, frozen=True, kw_only=True):
    schema: int
    software_version: str
    models: dict[str, str]
    timing_ms: dict[str, float]
    calibration: Calibration
    settings: SettingsForm
    expectation: ExpectationForm
    tag: TagForm | None
    tags_seen: tuple[int, ...]
    verdict: VerdictForm
    fruitlets: tuple[FruitletForm, ...]
    faint_px: tuple[XY, ...] = ()
    unsure_px: tuple[XY, ...] = ()
    tag_size_error: float | None = None
    window: WindowForm | None

    @classmethod
    def of(cls, reading: ClusterReading) -> Self:
        """Parts whose JSON is spelt as their value is stay values."""
        parts = _fields(reading) | {"schema": READING_SCHEMA_VERSION}
        del parts["schema_version"]
        packed = {
            "fruitlets": tuple(map(FruitletForm.of, reading.fruitlets)),
            "window": None if reading.window is None else WindowForm.of(reading.window),
        }
        return cls(**parts | packed)

    @property
    def target(self) -> tuple[FruitletForm, ...]:
        """The fruitlets of the tagged cluster."""
        return tuple(each for each in self.fruitlets if each.in_target)

    def value(self) -> ClusterReading:
        """Of the present schema version, whichever it was stored in."""
        parts = _parts(self) | {
            "settings": self.settings.value(),
            "expectation": self.expectation.value(),
            "tag": None if self.tag is None else self.tag.value(),
            "verdict": self.verdict.value(),
            "fruitlets": tuple(each.value() for each in self.fruitlets),
            "window": None if self.window is None else self.window.value(),
        }
        del parts["schema"]
        return ClusterReading(**parts)


def _parts(form: Form) -> dict[str, Any]:
    return msgspec.structs.asdict(form)


def _fields(value: TagPose | Fruitlet | ClusterReading) -> dict[str, Any]:
    return {each.name: getattr(value, each.name) for each in fields(value)}
