"""A tag of another family is named, and nothing else is taken for one."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from drawn_tags import draw_tag

from fieldcam.calibration.aruco_families import FAMILIES
from fieldcam.exchange.images import read_image
from fieldcam.values import ImageU8
from fieldcam.vision.tags.other_families import NOT_ASKED, other_family

GREY = np.full((400, 500), 120, np.uint8)


def shown(dictionary: int, side_px: int = 90) -> ImageU8:
    """A marker on white paper before grey."""
    marker = cv2.aruco.generateImageMarker(
        cv2.aruco.getPredefinedDictionary(dictionary), 7, side_px
    )
    picture = GREY.copy()
    picture[100 : 140 + side_px, 100 : 140 + side_px] = 235
    picture[120 : 120 + side_px, 120 : 120 + side_px] = marker
    return picture


@pytest.mark.parametrize("name", sorted(set(FAMILIES) - set(NOT_ASKED)))
def test_a_marker_of_opencvs_is_named(name: str) -> None:
    assert other_family(shown(FAMILIES[name])) == name


def test_an_apriltag_of_another_family_is_named() -> None:
    picture = shown(cv2.aruco.DICT_APRILTAG_25h9)
    assert other_family(np.repeat(picture[..., None], 3, axis=2)) == "tag25h9"


def test_ours_and_nothing_are_of_no_other_family() -> None:
    square = np.array([(150, 150), (250, 150), (250, 250), (150, 250)], float)
    for picture in (draw_tag(square, (400, 400)), GREY, GREY[:2, :2], shown(0, 24)):
        assert other_family(picture) == ""


def test_leaves_and_apples_are_no_tags(real: Path) -> None:
    for path in sorted((real / "apples_green" / "images").glob("*.jpg"))[:5]:
        assert other_family(read_image(path)) == ""
