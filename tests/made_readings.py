"""Readings made up for tests of what is done with readings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcam.codec.readings import EncodedReading, dump_reading, parse_reading
from fieldcam.values import (
    Calibration,
    ClusterReading,
    Ellipse,
    Expectation,
    Flag,
    Fruitlet,
    ImageU8,
    Mask,
    Settings,
    Status,
    TagPose,
    Verdict,
)

CAMERA = Calibration(640, 480, 760.0, 320.0, 240.0, 60.0)
TAG = TagPose(
    id=17,
    center_px=(320.0, 330.0),
    corners_px=((300.0, 350.0), (340.0, 350.0), (340.0, 310.0), (300.0, 310.0)),
    translation_mm=(0.0, 50.0, 440.0),
    rotation=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    decision_margin=60.0,
)


def disc_mask(x: float, y: float, diameter_px: float) -> Mask:
    """A filled circle."""
    x0, y0 = int(x - diameter_px / 2) - 1, int(y - diameter_px / 2) - 1
    side = int(diameter_px) + 3
    rows, columns = np.mgrid[y0 : y0 + side, x0 : x0 + side]
    return Mask(x0, y0, np.hypot(columns - x, rows - y) <= diameter_px / 2)


def made_fruitlet(
    number: int,
    center_px: tuple[float, float],
    diameter_mm: float | None = 9.0,
    in_target: bool = True,
    cluster: int | None = 0,
    flags: tuple[Flag, ...] = (),
    sd_mm: float | None = None,
) -> Fruitlet:
    """A round fruitlet of 18 px at the tag's range."""
    x, y = center_px
    sized = diameter_mm is not None
    return Fruitlet(
        id=number,
        in_target=in_target,
        diameter_mm=diameter_mm,
        center_px=center_px,
        box_px=(x - 9, y - 9, x + 9, y + 9),
        score=0.9,
        disparity_px=103.6 if sized else None,
        range_mm=440.0 if sized else None,
        visible_fraction=0.9,
        flags=flags,
        mask=disc_mask(x, y, 18),
        outline=Ellipse(center_px, 18.0, 18.0, 0.0) if sized else None,
        cluster=cluster,
        centroid_mm=(0.0, 0.0, 440.0) if sized else None,
        cloud_mm=np.zeros((0, 3), np.float32),
        sd_mm=sd_mm,
    )


def made_reading(
    fruitlets: Sequence[Fruitlet] = (),
    verdict: Verdict | None = None,
    tag: TagPose | None = TAG,
    expectation: Expectation | None = None,
) -> ClusterReading:
    """A reading of the camera above."""
    return ClusterReading(
        tag=tag,
        tags_seen=() if tag is None else (tag.id,),
        fruitlets=tuple(fruitlets),
        verdict=verdict or Verdict(Status.ACCEPT),
        window=None,
        calibration=CAMERA,
        settings=Settings(),
        expectation=expectation or Expectation(),
        timing_ms={"total": 1.0},
        models={"segmentation": "a" * 64, "stereo": "b" * 64},
        software_version="0.0",
    )


def encoded(reading: ClusterReading) -> EncodedReading:
    """As the analysis process hands it over."""
    return parse_reading(dump_reading(reading))


def grey_image(level: int = 90) -> ImageU8:
    """(480, 640, 3) of one grey."""
    return np.full((CAMERA.height_px, CAMERA.width_px, 3), level, np.uint8)
