"""Photographs with boxes: what is read, what is named and left out, what is pasted on them."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from export import find_unknown, pasted, real_tiles
from export import segmentation_data as data
from export import segmentation_window as windows

pytestmark = pytest.mark.export

LABELS = "0 0.5 0.5 0.25 0.5\n1 0.0 0.5 0.2 0.2\n\n"


def _tile(folder: Path, name: str, labels: str | bytes | None = LABELS, side: int = 64) -> Path:
    for part in ("images", "labels"):
        (folder / "pear" / part).mkdir(parents=True, exist_ok=True)
    path = folder / "pear" / "images" / f"{name}.png"
    image = np.random.default_rng(len(name)).integers(0, 255, (side, side, 3), dtype=np.uint8)
    assert cv2.imwrite(str(path), image)
    if labels is not None:
        text = labels if isinstance(labels, bytes) else labels.encode()
        (folder / "pear" / "labels" / f"{name}.txt").write_bytes(text)
    return path


def _all(folder: Path) -> list[real_tiles.Tile]:
    return [t for kept in (False, True) for t in real_tiles.list_tiles(folder, kept).all()]


def test_boxes_are_cut_at_the_border_and_in_pixels(tmp_path: Path) -> None:
    _tile(tmp_path, "a_1")
    window = _all(tmp_path)[0].read()
    assert window is not None
    assert window.boxes.tolist() == [
        [24, 16, 40, 48],
        [0, pytest.approx(25.6), pytest.approx(6.4), pytest.approx(38.4)],
    ]
    assert window.image.shape == (64, 64, 3)
    assert not len(window.whole)


@pytest.mark.parametrize(
    ("labels", "said"),
    [
        ("0 0.5 0.5 0.2", "line 1"),
        ("0 0.5 0.5 0.2 0.2\nx y z", "line 2"),
        ("0 1.5 0.5 0.2 0.2", "outside the picture"),
        ("0 0.5 0.5 -0.2 0.2", "outside the picture"),
        ("0 nan 0.5 0.2 0.2", "outside the picture"),
        (b"\xff\xfe\x00", "a_1.txt"),
        (None, "a_1.txt"),
    ],
)
def test_a_tile_with_bad_labels_is_named_and_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], labels: str | bytes | None, said: str
) -> None:
    _tile(tmp_path, "a_1", labels)
    _tile(tmp_path, "bb_1")
    assert [t.path.stem for t in _all(tmp_path)] == ["bb_1"]
    message = capsys.readouterr().err
    assert "a_1.png is left out" in message
    assert said in message


def test_stray_clicks_are_no_fruit_and_slivers_unknown(tmp_path: Path) -> None:
    _tile(tmp_path, "a_1", "0 0.5 0.5 0.1 0.0\n0 0.5 0.5 0.005 0.2\n0 0.2 0.2 0.1 0.1")
    tile = _all(tmp_path)[0]
    assert len(tile.boxes) == 1
    assert len(tile.unknown) == 1


def test_a_picture_that_is_half_there_is_named_and_passed_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = _tile(tmp_path, "a_1")
    path.write_bytes(path.read_bytes()[:40])
    assert _all(tmp_path)[0].read() is None
    assert "a_1.png cannot be decoded" in capsys.readouterr().err


def test_tiles_of_one_photograph_stay_together(tmp_path: Path) -> None:
    for photograph in range(40):
        for part in range(2):
            _tile(tmp_path, f"DSC_{photograph}_{part}", side=8)
    kept = {t.path.stem.rsplit("_", 1)[0] for t in real_tiles.list_tiles(tmp_path, True).all()}
    learnt = {t.path.stem.rsplit("_", 1)[0] for t in real_tiles.list_tiles(tmp_path, False).all()}
    assert kept
    assert len(kept) + len(learnt) == 40


def test_noted_unknown_places_come_with_their_tile(tmp_path: Path) -> None:
    _tile(tmp_path, "a_1")
    noted = tmp_path / "unknown.json"
    noted.write_text(json.dumps({"a_1.png": [[0.7, 0.7, 0.9, 0.9]]}))
    tiles = [
        t for kept in (False, True) for t in real_tiles.list_tiles(tmp_path, kept, noted).all()
    ]
    window = tiles[0].read()
    assert window is not None
    assert window.unknown.round(1).tolist() == [
        [pytest.approx(44.8), pytest.approx(44.8), pytest.approx(57.6), pytest.approx(57.6)]
    ]


def test_unboxed_fruit_is_apart_from_boxes_and_smaller() -> None:
    boxes = torch.tensor([[0.0, 0, 40, 40], [50, 50, 90, 90]])
    found = torch.tensor([[2.0, 0, 40, 40], [60, 0, 75, 15], [0, 50, 40, 90], [41, 41, 60, 60]])
    assert find_unknown.unboxed(found, boxes).tolist() == [False, True, False, True]
    assert not find_unknown.unboxed(found, boxes[:0]).any()


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("flip", [False, True])
def test_boxes_turn_with_the_pixels(turns: int, flip: bool) -> None:
    image = np.zeros((100, 100, 3), np.uint8)
    image[20:50, 30:80] = 255
    window = windows.Window(
        image, np.zeros((100, 100), np.uint8), np.zeros((0, 100, 100), bool),
        np.array([[30, 20, 80, 50]], np.float32),
    )  # fmt: skip
    sample = windows.cut(window, windows.Placement(10, 0, 90, 90, turns, flip), 90)
    rows, columns = np.nonzero(sample.image[..., 0])
    assert sample.certain == 1
    assert sample.boxes[0].tolist() == [
        columns.min(), rows.min(), columns.max() + 1, rows.max() + 1,
    ]  # fmt: skip


def test_a_box_that_the_crop_mostly_loses_is_left_out_of_the_loss() -> None:
    window = windows.Window(
        np.zeros((100, 100, 3), np.uint8), np.zeros((100, 100), np.uint8),
        np.zeros((0, 100, 100), bool),
        np.array([[0, 0, 40, 40], [60, 60, 90, 90], [20, 20, 90, 90]], np.float32),
    )  # fmt: skip
    sample = windows.cut(window, windows.Placement(50, 50, 50, 50, 0, False), 50)
    assert sample.certain == 1
    assert sample.boxes.tolist() == [[10, 10, 40, 40], [0, 0, 40, 40]]
    _, target = data.as_tensors(sample)
    assert target["labels"].tolist() == [1, -1]


def _front() -> tuple[windows.Window, pasted.Bool]:
    labels = np.zeros((64, 64), np.uint8)
    labels[10:30, 10:30] = 1
    image = np.full((64, 64, 3), 90, np.uint8)
    image[labels == 1] = 220
    front = labels > 0
    return windows.Window(image, labels, front[None]), front


def test_what_is_pasted_keeps_its_pixels_and_hides_boxes() -> None:
    window, front = _front()
    boxes = np.array([[40, 40, 60, 60], [12, 12, 28, 28], [20, 20, 44, 44]], np.float32)
    back = windows.Window(
        np.full((64, 64, 3), 60, np.uint8), np.zeros((64, 64), np.uint8),
        np.zeros((0, 64, 64), bool), boxes,
    )  # fmt: skip
    joined = pasted.paste(window, front, back, np.random.default_rng(0))
    assert np.all(joined.image[13:27, 13:27] == 220)
    assert joined.boxes.tolist() == [[40, 40, 60, 60], [20, 20, 44, 44]]
    assert len(joined.unknown) == 0
    assert np.array_equal(joined.labels, window.labels)


def test_a_rendered_front_holds_whole_fruit_and_what_is_nearer(tmp_path: Path) -> None:
    labels = np.zeros((32, 32), np.uint8)
    labels[2:8, 2:8], labels[20:26, 20:26] = 1, 2
    disparity = np.full((32, 32), 100, np.float32)
    disparity[labels == 1], disparity[labels == 2] = 230, 200
    disparity[10:14] = 260
    disparity[0] = np.nan
    whole = np.packbits(np.stack([labels == 1, labels == 2]), axis=-1)
    path = tmp_path / "1.npz"
    np.savez(
        path, left=np.zeros((32, 32, 3), np.uint8), labels=labels, whole=whole, disparity=disparity
    )
    seen = set()
    for seed in range(20):
        _, front = pasted.read_front(path, np.random.default_rng(seed))
        assert front[10:14].all()
        assert front[labels == 1].all()
        assert not front[0].any()
        assert not front[16].any()
        seen.add(bool(front[labels == 2].all()))
    assert seen == {True, False}
