"""From the network's boxes and cells to instances in image pixels."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from fieldcam.errors import ModelMissing
from fieldcam.values import Region
from fieldcam.vision.segmentation import (
    RawInstances,
    Segmenter,
    faint,
    instances,
    is_cut,
    resample,
)

Array = npt.NDArray[Any]
CELLS = 28
IMAGE = Region(0, 0, 200, 160)


def disc_cells(
    box: tuple[float, float, float, float], center: tuple[float, float], radius: float
) -> npt.NDArray[np.float64]:
    """(1, M, M) logits of a disc, with its centre in pixel coordinates."""
    step = (np.arange(CELLS) + 0.5) / CELLS
    x = box[0] + step * (box[2] - box[0]) - 0.5
    y = box[1] + step * (box[3] - box[1]) - 0.5
    return (radius - np.hypot(x[None, :] - center[0], y[:, None] - center[1]))[None]


def raw(*discs: tuple[float, float, float, float], channels: int = 1) -> RawInstances:
    """One instance for each (x, y, radius, score)."""
    boxes = [(x - r - 4.3, y - r - 4.9, x + r + 5.2, y + r + 3.8) for x, y, r, _ in discs]
    cells = [disc_cells(b, (x, y), r) for b, (x, y, r, _) in zip(boxes, discs, strict=True)]
    return RawInstances(
        boxes_px=np.array([(x - r, y - r, x + r, y + r) for x, y, r, _ in discs]),
        scores=np.array([s for *_, s in discs]),
        mask_boxes_px=np.array(boxes),
        mask_logits=np.stack([np.repeat(c, channels, axis=0) for c in cells]),
    )


@pytest.mark.parametrize("center", [(60.0, 50.0), (60.37, 49.81)])
def test_cells_land_on_their_pixels(center: tuple[float, float]) -> None:
    (found,) = instances(raw((*center, 20.0, 0.9)), IMAGE, 0.4)
    rows, columns = np.nonzero(found.visible.window)
    assert columns.mean() + found.visible.x0 == pytest.approx(center[0], abs=0.06)
    assert rows.mean() + found.visible.y0 == pytest.approx(center[1], abs=0.06)
    assert found.visible.area_px == pytest.approx(np.pi * 400, rel=0.01)
    assert found.whole_logits is None


def test_resampling_is_exact_for_linear_logits() -> None:
    box = (10.3, 20.7, 66.3, 76.7)
    step = (np.arange(CELLS) + 0.5) / CELLS
    cells = np.broadcast_to(box[0] + step * 56 - 0.5, (CELLS, CELLS))
    pixels = resample(cells, box, Region(10, 20, 67, 77))
    np.testing.assert_allclose(pixels[5, 3:54], np.arange(13, 64), atol=1e-4)


def test_masks_are_clipped_to_the_region() -> None:
    region = Region(50, 40, 120, 100)
    (found,) = instances(raw((52.0, 60.0, 15.0, 0.9)), region, 0.4)
    assert found.visible.region.x0 == 50
    assert is_cut(found, region)
    (inside,) = instances(raw((85.0, 70.0, 15.0, 0.9)), region, 0.4)
    assert not is_cut(inside, region)


def test_each_pixel_goes_to_one_instance_and_the_edge_lies_between_the_two() -> None:
    found = instances(raw((60.0, 60.0, 20.0, 0.9), (90.0, 60.0, 20.0, 0.8)), IMAGE, 0.4)
    painted = np.zeros((160, 200), dtype=int)
    for instance in found:
        painted[instance.visible.region.slices] += instance.visible.window
    assert painted.max() == 1
    left, right = found
    columns = np.nonzero(left.visible.window)[1]
    assert (columns + left.visible.x0).max() in (74, 75)
    columns = np.nonzero(right.visible.window)[1]
    assert (columns + right.visible.x0).min() in (75, 76)
    assert ((left.visible_logits > 0) == left.visible.window).all()


def test_low_scores_doubles_and_specks_are_left_out_and_the_best_comes_first() -> None:
    found = instances(
        raw(
            (60.0, 60.0, 20.0, 0.6),
            (61.0, 60.0, 19.0, 0.5),
            (120.0, 60.0, 20.0, 0.9),
            (160.0, 120.0, 20.0, 0.3),
            (30.0, 130.0, 2.0, 0.9),
        ),
        IMAGE,
        0.4,
    )
    assert [f.score for f in found] == [0.9, 0.6]


class OneDisc:
    """Answers with one disc in the middle of whatever it is shown."""

    def __init__(self) -> None:
        self.shape: tuple[int, ...] = ()

    def warm_up(self) -> None: ...

    def run(self, inputs: Mapping[str, Array]) -> dict[str, Array]:
        self.shape = inputs["image"].shape
        _, height, width = self.shape
        made = raw(((width - 1) / 2, (height - 1) / 2, 10.0, 0.9), channels=2)
        return {
            "boxes": made.boxes_px,
            "scores": made.scores,
            "mask_boxes": made.mask_boxes_px,
            "mask_logits": made.mask_logits,
        }


@pytest.mark.parametrize(
    ("scale", "shape", "area"), [(1.0, (3, 60, 80), 314), (0.5, (3, 30, 40), 1257)]
)
def test_a_region_is_segmented_in_image_pixels_at_any_scale(
    tmp_path: Path, scale: float, shape: tuple[int, ...], area: int
) -> None:
    network = OneDisc()
    segmenter = Segmenter(tmp_path / "none.onnx", 0.4, scale, network)
    region = Region(100, 50, 180, 110)
    (found,) = segmenter.segment(np.zeros((160, 200, 3), np.uint8), region).instances
    rows, columns = np.nonzero(found.visible.window)
    assert network.shape == shape
    assert columns.mean() + found.visible.x0 == pytest.approx(139.5, abs=0.1)
    assert rows.mean() + found.visible.y0 == pytest.approx(79.5, abs=0.1)
    assert found.visible.area_px == pytest.approx(area, rel=0.02)
    assert found.whole_logits is not None


def test_what_scores_too_low_is_kept_as_a_place_beside_the_fruitlets() -> None:
    made = raw((60, 60, 20, 0.9), (62, 58, 18, 0.5), (140, 60, 9, 0.5), (140, 100, 9, 0.1))
    found = instances(made, IMAGE, 0.8)
    assert len(found) == 1
    assert faint(made, found, 0.8) == ((140.0, 60.0),)


@pytest.mark.parametrize("content", [None, b"", b"not a network"])
def test_a_missing_or_broken_network_is_said_so(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "segmentation.onnx"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ModelMissing, match=r"segmentation\.onnx") as raised:
        Segmenter(path).segment(np.zeros((20, 20, 3), np.uint8))
    assert raised.value.hint
