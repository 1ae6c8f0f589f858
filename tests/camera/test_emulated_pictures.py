"""What the emulated eyes see."""

from __future__ import annotations

from contextlib import closing

import cv2
import numpy as np
import pytest
from emulated_camera.pictures import Darkroom, Development, gradients, mosaic


def test_a_mosaic_holds_red_green_and_blue_where_the_pattern_says() -> None:
    image = np.zeros((4, 6, 3), np.uint8)
    image[:] = (10, 20, 30)
    found = mosaic(image)
    assert found[:2, :2].tolist() == [[10, 20], [20, 30]]
    # OpenCV names the pattern by its second row: this is RGGB.
    again = cv2.cvtColor(found, cv2.COLOR_BayerBG2RGB)
    assert np.array_equal(again, image)


def test_gradients_have_a_positive_disparity_and_tell_exposures_apart() -> None:
    source = gradients(64, 48, 10)
    left, right = source(3)
    assert np.array_equal(left[:, 10:], right[:, :-10])
    assert not np.array_equal(left, source(4)[0])
    assert source(3)[0] is source(11)[0]


def test_the_darkroom_scales_clips_and_keeps() -> None:
    darkroom = Darkroom()
    picture = np.full((2, 2), 100, np.uint8)
    double = Development(2.0, black_level=5.0, red=0.5, blue=2.0)
    found = darkroom.develop(picture, double)
    assert found.tolist() == [[105, 205], [205, 255]]
    assert darkroom.develop(picture, double) is found
    with pytest.raises(ValueError, match="read-only"):
        found[0, 0] = 1


@pytest.mark.slow
def test_the_orchard_goes_from_cluster_to_cluster() -> None:
    from emulated_camera.orchard import Orchard

    with closing(Orchard(seed=5, clusters=2, day=0)) as orchard:
        first = orchard(0)
        assert [eye.shape for eye in first] == [(1080, 1440), (1080, 1440)]
        assert orchard.go_on() == orchard.tag_ids[1]
        assert not np.array_equal(orchard(1)[0], first[0])
        assert orchard.go_on() == orchard.tag_ids[0]
        assert np.array_equal(orchard(2)[0], first[0])
