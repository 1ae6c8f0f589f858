"""Training crops: masks, boxes and pixels stay together; drawn truth is exact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from export import drawn_crops as drawn
from export import drawn_objects as objects
from export import photometric
from export import segmentation_data as data
from export import segmentation_window as windows

pytestmark = pytest.mark.export


def _window(side: int = 200) -> windows.Window:
    """Two fruitlets whose brightness tells them from the ground; one partly hidden."""
    y, x = np.mgrid[0:side, 0:side]
    near = np.hypot(x - 70, y - 80) < 30
    far = np.hypot(x - 120, y - 80) < 28
    labels = np.where(near, 1, np.where(far, 2, 0)).astype(np.uint8)
    image = np.zeros((side, side, 3), np.uint8)
    image[labels == 1] = 200
    image[labels == 2] = 120
    return windows.Window(image, labels, np.stack([near, far]))


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize(("side", "out"), [(160, 96), (100, 160), (128, 128)])
def test_masks_follow_the_pixels(turns: int, flip: bool, side: int, out: int) -> None:
    sample = windows.cut(_window(), windows.Placement(30, 35, side, out, turns, flip), 176)
    assert sample.image.shape == (176, 176, 3)
    bright, dim = sample.masks[0, 0], sample.masks[1, 0]
    assert np.all(sample.image[bright == 255] > 190)
    assert np.all(np.abs(sample.image[dim == 255].astype(int) - 120) < 10)
    assert np.all(sample.masks[:, 1] >= sample.masks[:, 0])
    for mask, (x0, y0, x1, y1) in zip(sample.masks[:, 0], sample.boxes, strict=True):
        rows, columns = np.nonzero(mask > 127)
        assert (x0, y0) == (columns.min(), rows.min())
        assert (x1, y1) == (columns.max() + 1, rows.max() + 1)


def test_scale_is_that_of_the_placement() -> None:
    small = windows.cut(_window(), windows.Placement(0, 0, 200, 100, 0, False), 100)
    area = small.masks[0, 1].sum() / 255.0
    assert area == pytest.approx(np.pi * 30**2 / 4, rel=0.01)


@pytest.mark.parametrize(
    ("hidden_below", "expected"), [(0, [False, False]), (92, [False, False]), (102, [False, True])]
)
def test_barely_visible_fruitlets_are_ignored_and_last(
    hidden_below: int, expected: list[bool]
) -> None:
    window = _window()
    labels = window.labels.copy()
    rows = np.arange(labels.shape[0])[:, None]
    labels[(labels == 1) & (rows < hidden_below)] = 0
    sample = windows.cut(
        windows.Window(window.image, labels, window.whole),
        windows.Placement(0, 0, 200, 200, 0, False),
        200,
    )
    assert (np.arange(len(sample.boxes)) >= sample.certain).tolist() == expected
    _, target = data.as_tensors(sample)
    assert target["labels"].tolist() == [-1 if e else 1 for e in expected]
    assert len(target["masks"]) == expected.count(False)


def test_fruitlets_outside_the_crop_are_left_out() -> None:
    sample = windows.cut(_window(), windows.Placement(0, 0, 90, 90, 0, False), 90)
    assert len(sample.boxes) == 1


def test_crops_hold_their_focus() -> None:
    window = _window()
    rng = np.random.default_rng(0)
    settings = windows.CropSettings(size_px=64)
    with_fruit = 0
    for _ in range(60):
        where = windows.place(window, settings, rng)
        assert 0 <= where.x <= 200 - where.side
        assert 0 <= where.y <= 200 - where.side
        with_fruit += bool(window.labels[where.y :, where.x :][: where.side, : where.side].any())
    assert with_fruit > 48


def test_light_changes_nothing_but_colour() -> None:
    rng = np.random.default_rng(1)
    image = rng.integers(0, 255, (64, 80, 3), dtype=np.uint8)
    fruit = np.zeros((64, 80), np.float32)
    changed = [photometric.jitter(image, fruit, np.random.default_rng(i)) for i in range(30)]
    assert all(c.shape == image.shape and c.dtype == np.uint8 for c in changed)
    assert any(not np.array_equal(c, image) for c in changed)


@pytest.mark.parametrize("radius", [8.0, 23.7, 55.2])
def test_drawn_outline_is_true(radius: float) -> None:
    turn = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    points = np.stack([np.cos(turn), np.sin(turn)], axis=1) * radius + (80.3, 91.8)
    x, y, alpha = objects.fill_outline(points.astype(np.float32))
    rows, columns = np.mgrid[0 : alpha.shape[0], 0 : alpha.shape[1]]
    assert np.sqrt(alpha.sum() / np.pi) == pytest.approx(radius, abs=0.03)
    assert (columns * alpha).sum() / alpha.sum() + x == pytest.approx(80.3, abs=0.03)
    assert (rows * alpha).sum() / alpha.sum() + y == pytest.approx(91.8, abs=0.03)


def test_drawn_windows_survive_their_shard(tmp_path: Path) -> None:
    canvas = drawn.draw_canvas(np.random.default_rng(5))
    window = canvas.window()
    drawn.save_canvas(canvas, tmp_path / "5.npz")
    again = windows.read_window(tmp_path / "5.npz")
    assert np.array_equal(again.image, window.image)
    assert np.array_equal(again.labels, window.labels)
    assert np.array_equal(again.whole, window.whole)
    assert [p.name for p in data.list_shards(tmp_path)] == ["5.npz"]


def test_drawn_visible_pixels_lie_inside_their_outline() -> None:
    for seed in (0, 1, 2):
        window = drawn.draw_window(np.random.default_rng(seed))
        for index, whole in enumerate(window.whole, start=1):
            assert not np.any((window.labels == index) & ~whole)


def test_the_stream_repeats_itself_from_any_sample(tmp_path: Path) -> None:
    for seed in range(3):
        drawn.save_canvas(drawn.draw_canvas(np.random.default_rng(seed)), tmp_path / f"{seed}.npz")
    sources = data.Sources(drawn=tmp_path)
    settings = windows.CropSettings(size_px=96)
    first = iter(data.CropStream(sources, settings, 3, 0))
    images = [next(first)[0] for _ in range(4)]
    later = iter(data.CropStream(sources, settings, 3, 2))
    assert bool((next(later)[0] == images[2]).all())
    assert bool((next(later)[0] == images[3]).all())
