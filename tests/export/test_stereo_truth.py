"""Truth stays where it belongs when a pair is cut, shrunk, mirrored or disturbed."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

pytest.importorskip("torch")
sample = pytest.importorskip("export.stereo_sample")
data = pytest.importorskip("export.stereo_data")
scenes = pytest.importorskip("export.stereo_scenes")
augment = pytest.importorskip("export.stereo_augment")

pytestmark = pytest.mark.export

SIDE = 128
OFFSET_PX = 200


def _picture(columns: np.ndarray) -> np.ndarray:
    """A smooth picture that can be drawn at any fractional column, (rows, columns, 3) uint8."""
    rows = np.arange(columns.shape[0])[:, None]
    waves = [np.sin(columns / a + rows / b) for a, b in ((5, 9), (7, 6), (11, 8))]
    return np.stack([127 + 100 * wave for wave in waves], axis=-1).astype(np.uint8)


@pytest.fixture
def plane(tmp_path: Path) -> Path:
    """A rendered window of a slanted plane, its left 20 columns at infinity."""
    columns = np.broadcast_to(np.arange(SIDE, dtype=float), (SIDE, SIDE))
    slope, base = 0.05, 6.0
    disparity = (base + slope * columns + OFFSET_PX).astype(np.float32)
    # What the right eye sees at x came from (x + base) / (1 - slope) in the left.
    np.savez_compressed(
        tmp_path / "1.npz",
        left=_picture(columns),
        right=_picture((columns + base) / (1 - slope)),
        offset_px=np.int32(OFFSET_PX),
        disparity=np.where(columns < 20, np.nan, disparity).astype(np.float32),
        noc=np.ones((SIDE, SIDE), bool),
        labels=np.where(columns > 90, 2, 0).astype(np.uint8),
    )
    return tmp_path / "1.npz"


def _mismatch(pair: object) -> float:
    """Mean grey difference between left pixels and their true matches."""
    columns = np.arange(pair.disparity.shape[1]) - pair.disparity  # type: ignore[attr-defined]
    inside = (columns >= 0) & (columns <= pair.disparity.shape[1] - 1)  # type: ignore[attr-defined]
    matched = sample.sample_columns(columns, pair.right[..., 0].astype(np.float32))  # type: ignore[attr-defined]
    difference = np.abs(matched - pair.left[..., 0])  # type: ignore[attr-defined]
    used = inside & pair.seen  # type: ignore[attr-defined]
    assert used.mean() > 0.3
    return float(difference[used].mean())


@pytest.mark.parametrize("size", [64, 48, 100])
def test_shrunk_pair_matches_at_the_shrunk_truth(plane: Path, size: int) -> None:
    small = sample.shrink(data.read_shard(plane), size, size)
    assert _mismatch(small) < 2.0


def test_truth_half_a_pixel_off_would_be_noticed(plane: Path) -> None:
    small = sample.shrink(data.read_shard(plane), 64, 64)
    moved = sample.StereoSample(
        small.left, small.right, small.disparity + 0.5, small.seen, small.decided, small.fruit
    )
    assert _mismatch(moved) > 2 * _mismatch(small) + 2


def test_halving_takes_the_mean_of_four() -> None:
    grid = np.arange(16, dtype=np.float32).reshape(4, 4) / 10
    grid[0, 0] = 90
    flags = np.ones((4, 4), bool)
    blank = np.zeros((4, 4, 3), np.uint8)
    small = sample.shrink(sample.StereoSample(blank, blank, grid, flags, flags, flags), 2, 2)
    assert np.isnan(small.disparity[0, 0])
    assert small.disparity[1, 1] == pytest.approx(grid[2:, 2:].mean() / 2, abs=1e-4)
    assert not small.decided[0, 0]
    assert small.decided[1, 1]


@pytest.mark.parametrize("later", [-9, 0, 13])
def test_cut_with_another_offset_still_matches(plane: Path, later: int) -> None:
    window = data.read_shard(plane)
    piece = data.cut(window, 16, 24, 80, later)
    expected = window.disparity[16:96, 24:104] + later
    assert np.allclose(piece.disparity, expected)
    assert _mismatch(piece) < 2.0


def test_mirrored_swap_still_matches(plane: Path) -> None:
    turned = sample.mirrored_swap(data.read_shard(plane))
    assert _mismatch(turned) < 2.0


def test_nothing_is_decided_about_what_only_the_other_eye_saw(plane: Path) -> None:
    turned = sample.mirrored_swap(data.read_shard(plane))
    assert not turned.decided[~np.isfinite(turned.disparity)].any()


def test_photographs_become_textures_and_a_damaged_one_does_not(tmp_path: Path) -> None:
    image = np.random.default_rng(0).integers(0, 255, (90, 120, 3), dtype=np.uint8)
    good, bad = tmp_path / "good.png", tmp_path / "bad.png"
    assert cv2.imwrite(str(good), image)
    bad.write_bytes(good.read_bytes()[:30])
    rng = np.random.default_rng(3)
    atlas = scenes.photograph_atlas(good, rng)
    assert atlas is not None
    assert atlas.shape == (scenes.ATLAS_PX, scenes.ATLAS_PX, 3)
    assert scenes.photograph_atlas(bad, rng) is None
    pair = scenes.LayeredScenes(seed=4, textures=3, photographs=[good, bad]).draw(rng, 128, 32)
    assert _mismatch(pair) < 6.0


def test_fruit_stays_on_its_columns(plane: Path) -> None:
    small = sample.shrink(data.read_shard(plane), 64, 64)
    assert np.array_equal(np.flatnonzero(small.fruit[5]), np.arange(46, 64))
    # Column 91 is seen at 91 - 6 - 0.05 * 91 = 80.45 by the right eye, which is then mirrored.
    turned = sample.mirrored_swap(data.read_shard(plane))
    assert np.flatnonzero(turned.fruit[5]).max() in (127 - 81, 127 - 80)


def test_infinity_counts_as_unmatched(plane: Path) -> None:
    batch = data.to_batch([data.read_shard(plane)])
    assert not batch.known[..., :20].any()
    assert batch.matched[..., :20].sum() == 0
    assert batch.decided.all()


def test_pixels_leaving_the_window_count_as_unmatched() -> None:
    flat = np.full((16, 32), 5, np.float32)
    flags = np.ones((16, 32), bool)
    blank = np.zeros((16, 32, 3), np.uint8)
    batch = data.to_batch([sample.StereoSample(blank, blank, flat, flags, flags, ~flags)])
    assert batch.matched[0, 0, 0].tolist() == [0.0] * 5 + [1.0] * 27


def test_drawn_scene_matches_at_its_truth() -> None:
    rng = np.random.default_rng(5)
    pair = scenes.LayeredScenes(seed=4, textures=3).draw(rng, 128, 32)
    assert _mismatch(pair) < 3.0
    assert 0.01 < 1 - pair.seen.mean() < 0.6


def test_disturbing_keeps_truth_and_only_hides_more() -> None:
    rng = np.random.default_rng(6)
    pair = scenes.LayeredScenes(seed=4, textures=2).draw(rng, 96, 32)
    for _ in range(8):
        changed = augment.disturb(pair, rng)
        assert np.array_equal(changed.disparity, pair.disparity)
        assert not (changed.seen & ~pair.seen).any()


def test_batches_repeat_for_a_seed_and_see_new_windows(
    tmp_path: Path, plane: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(data, "LayeredScenes", partial(data.LayeredScenes, textures=1))
    folder = tmp_path / "train"
    folder.mkdir()
    first = data.StereoBatches(folder, 3, 0.0)[0]
    again = data.StereoBatches(folder, 3, 0.0)[0]
    assert first.left.equal(again.left)
    assert data.list_shards(folder) == []
    plane.rename(folder / "7.npz")
    assert data.list_shards(folder) == [folder / "7.npz"]
