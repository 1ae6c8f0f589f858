"""Pairs of a board are found by the names that other programs give them."""

from __future__ import annotations

from pathlib import Path

import pytest

from fieldcam.exchange.board_pairs import read_pair_folder

LAYOUTS = {
    "calibrate's": ("1_left.png", "1_right.png", "2_left.png", "2_right.png"),
    "OpenCV's samples": ("left01.jpg", "right01.jpg", "left02.jpg", "right02.jpg"),
    "camera_calibration's": (
        "left-0000.png", "right-0000.png", "left-0001.png", "right-0001.png",
    ),
    "folders": ("left/1.png", "right/1.png", "left/2.png", "right/2.png"),
    "folders and names": (
        "left/left01.jpg", "right/right01.jpg", "left/left02.jpg", "right/right02.jpg",
    ),
    "capitals": ("1_Left.jpg", "1_Right.jpg", "2_Left.jpg", "2_Right.jpg"),
    "shouted": ("1_LEFT.JPG", "1_RIGHT.JPG", "2_LEFT.JPG", "2_RIGHT.JPG"),
    "folders in capitals": ("Left/a1.png", "Right/a1.png", "Left/a2.png", "Right/a2.png"),
    "camel": ("camLeft1.png", "camRight1.png", "camLeft2.png", "camRight2.png"),
    "Kalibr's": ("cam0/17.png", "cam1/17.png", "cam0/18.png", "cam1/18.png"),
    "robots'": (
        "cam0/data/17.png", "cam1/data/17.png", "cam0/data/18.png", "cam1/data/18.png",
    ),
    "cameras": ("cam0_1.png", "cam1_1.png", "cam0_2.png", "cam1_2.png"),
    "cameras from one": ("cam1_5.png", "cam2_5.png", "cam1_6.png", "cam2_6.png"),
    "letters": ("1_L.png", "1_R.png", "2_L.png", "2_R.png"),
    "letters in front": ("L01.png", "R01.png", "L02.png", "R02.png"),
    "image folders": ("image_0/01.png", "image_1/01.png", "image_0/02.png", "image_1/02.png"),
}  # fmt: skip


def written(folder: Path, *names: str) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.touch()
    return folder


@pytest.mark.parametrize("layout", LAYOUTS)
def test_pairs_are_found(tmp_path: Path, layout: str) -> None:
    names = LAYOUTS[layout]
    found = read_pair_folder(written(tmp_path, *names))
    paths = [str(p.relative_to(tmp_path)) for pair in found.pairs for p in (pair.left, pair.right)]
    assert paths == list(names)
    assert found.problems == ()


def test_a_single_pair_needs_no_other_name(tmp_path: Path) -> None:
    (pair,) = read_pair_folder(written(tmp_path, "LEFT.JPG", "RIGHT.JPG")).pairs
    assert (pair.left.name, pair.right.name) == ("LEFT.JPG", "RIGHT.JPG")


def test_an_eye_inside_another_word_is_none(tmp_path: Path) -> None:
    names = ("bright1_left.png", "bright1_right.png", "leftover_left.png", "leftover_right.png")
    found = read_pair_folder(written(tmp_path, *names))
    assert [(p.left.name, p.right.name) for p in found.pairs] == [names[:2], names[2:]]
