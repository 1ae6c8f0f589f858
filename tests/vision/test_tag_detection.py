"""Tags are found where they are, and nowhere else."""

from __future__ import annotations

import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from drawn_tags import IMAGE_CORNERS, draw_tag

from fieldcam.exchange.images import read_image
from fieldcam.values import Calibration, TagPose
from fieldcam.vision.tags.detection import choose_tag, detect_tags

Array = npt.NDArray[np.float64]

CAMERA = Calibration(1440, 1080, 1717.0, 719.5, 539.5, 60.0)
PHOTOGRAPHS = Path("apriltag") / "nasa_swarmathon"


def square(side_px: float, center_px: tuple[float, float], turn_deg: float = 0.0) -> Array:
    turn = np.radians(turn_deg)
    rotation = np.array([(np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))])
    return np.asarray(IMAGE_CORNERS * side_px / 2 @ rotation.T + np.array(center_px))


@pytest.mark.parametrize("side_px", [16, 30, 60, 110])
@pytest.mark.parametrize("turn_deg", [0, 20, 90, 200])
def test_corners_are_in_pixels_centred_at_integers(side_px: int, turn_deg: int) -> None:
    truth = square(side_px, (80.3, 78.8), turn_deg)
    (tag,) = detect_tags(draw_tag(truth, (160, 160)))
    errors = np.array(tag.corners_px) - truth
    assert tag.id == 17
    assert np.abs(errors).max() < (0.1 if side_px >= 60 else 0.6)
    assert np.abs(np.array(tag.center_px) - (80.3, 78.8)).max() < (0.1 if side_px >= 60 else 0.4)


def test_a_colour_picture_gives_the_same_tags_as_a_grey_one() -> None:
    grey = draw_tag(square(60, (80, 80)), (160, 160))
    assert detect_tags(np.repeat(grey[..., None], 3, axis=2)) == detect_tags(grey)


@pytest.mark.parametrize("light", [15, 30, 60])
def test_a_dark_tag_is_still_read(light: int) -> None:
    picture = draw_tag(square(100, (80, 80)), (160, 160), dark=3, light=light, noise=1)
    assert [tag.id for tag in detect_tags(picture)] == [17]


def project(points_mm: Array) -> Array:
    return np.column_stack(
        (
            CAMERA.focal_px * points_mm[:, 0] / points_mm[:, 2] + CAMERA.cx_px,
            CAMERA.focal_px * points_mm[:, 1] / points_mm[:, 2] + CAMERA.cy_px,
        )
    )


@pytest.mark.parametrize("tilt_deg", [(0, 0, 0), (25, 0, 10), (0, -30, 170), (15, 20, -80)])
def test_pose_of_a_tag_of_known_size(tilt_deg: tuple[float, float, float]) -> None:
    rotation = cv2.Rodrigues(np.radians(np.array(tilt_deg, dtype=np.float64)))[0]
    center_mm = np.array([12.0, -20.0, 440.0])
    square_mm = np.column_stack((IMAGE_CORNERS * 27.95 / 2, np.zeros(4)))
    corners_px = project(square_mm @ rotation.T + center_mm)
    shift = np.floor(corners_px.mean(axis=0)) - 100
    picture = np.full((1080, 1440), 128, np.uint8)
    x, y = (int(value) for value in shift)
    picture[y : y + 200, x : x + 200] = draw_tag(corners_px - shift, (200, 200))
    (tag,) = detect_tags(picture, CAMERA)
    assert tag.translation_mm == pytest.approx(tuple(center_mm), abs=0.3)
    turn_between = np.array(tag.rotation) @ rotation.T
    assert np.degrees(np.arccos(min(1.0, (np.trace(turn_between) - 1) / 2))) < 2.0


def test_without_a_calibration_a_tag_has_no_pose() -> None:
    (tag,) = detect_tags(draw_tag(square(60, (80, 80)), (160, 160)))
    assert tag.translation_mm is None and tag.rotation is None and tag.range_mm is None


def test_two_tags_with_one_id_are_both_reported() -> None:
    tag = draw_tag(square(60, (80, 80)), (160, 160))
    assert [found.id for found in detect_tags(np.hstack((tag, tag)))] == [17, 17]


def textures() -> list[npt.NDArray[np.uint8]]:
    rng = np.random.default_rng(3)
    noise = rng.normal(0, 1, (480, 640)).astype(np.float32)
    smooth = [cv2.GaussianBlur(noise, (0, 0), sigma) for sigma in (0.5, 1, 2, 4, 8)]
    grey = [cv2.normalize(image, np.empty(0), 0, 255, cv2.NORM_MINMAX) for image in smooth]
    checks = np.kron(rng.integers(0, 2, (80, 106)), np.ones((6, 6))) * 255
    black_and_white = [np.where(image > 0, 255, 0) for image in smooth]
    flat = [np.zeros((480, 640)), np.full((480, 640), 255)]
    return [np.asarray(image, np.uint8) for image in (*grey, *black_and_white, checks, *flat)]


def test_nothing_is_found_in_textures() -> None:
    assert [detect_tags(texture) for texture in textures()] == [()] * len(textures())


def tag(tag_id: int, x: float, y: float) -> TagPose:
    return TagPose(tag_id, (x, y), (), None, None, 50.0)


@pytest.mark.parametrize(
    ("tags", "expected", "chosen"),
    [
        ((), 7, None),
        ((tag(1, 10, 10), tag(2, 300, 200)), None, (2, 300)),
        ((tag(1, 10, 10), tag(2, 300, 200)), 1, (1, 10)),
        ((tag(1, 10, 10), tag(2, 300, 200)), 9, (2, 300)),
        ((tag(7, 10, 10), tag(7, 290, 240), tag(2, 319, 239)), 7, (7, 290)),
    ],
)
def test_the_expected_tag_counts_else_the_nearest_the_centre(
    tags: tuple[TagPose, ...], expected: int | None, chosen: tuple[int, float] | None
) -> None:
    found = choose_tag(tags, expected, (640, 480))
    assert (None if found is None else (found.id, found.center_px[0])) == chosen


def test_threads_may_share_the_detector() -> None:
    pictures = [draw_tag(square(60, (80, 80)), (160, 160), tag_id) for tag_id in range(8)]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(detect_tags, pictures * 4))
    assert [[tag.id for tag in tags] for tags in found] == [[i] for i in range(8)] * 4


def test_the_process_ends_cleanly_after_detecting() -> None:
    program = (
        "import numpy as np\n"
        "from fieldcam.vision.tags.detection import detect_tags\n"
        "held = detect_tags(np.zeros((90, 90), np.uint8))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def reference_tags(path: Path) -> list[tuple[int, Array]]:
    """Ids and corners (4, 2); the file puts the first pixel's centre at (0.5, 0.5)."""
    rows = [re.findall(r"-?\d+\.?\d*", line) for line in path.read_text().splitlines()]
    return [
        (int(row[0]), np.array(row[1:], dtype=np.float64).reshape(4, 2) - 0.5)
        for row in rows
        if len(row) == 9
    ]


def sides_px(corners: Array) -> Array:
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1))


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("33369213973_9d9bb4cc96_c", 12),
        ("34085369442_304b6bafd9_c", 25),
        ("34139872896_defdb2f8d9_c", 10),
    ],
)
def test_photographed_tags_are_where_the_reference_says(real: Path, name: str, count: int) -> None:
    found = detect_tags(read_image(real / PHOTOGRAPHS / f"{name}.jpg"))
    references = reference_tags(real / PHOTOGRAPHS / f"{name}.txt")
    assert len(references) == count
    large_enough = [(i, corners) for i, corners in references if sides_px(corners).min() >= 12]
    for tag_id, corners in large_enough:
        errors = [np.linalg.norm(np.array(t.corners_px) - corners, axis=1).max() for t in found]
        nearest = int(np.argmin(errors))
        assert errors[nearest] < 0.5, f"tag at {corners.mean(axis=0)}"
        assert found[nearest].id == tag_id


def test_photographs_of_apples_hold_no_tags(real: Path) -> None:
    photographs = sorted((real / "apples_green" / "images").glob("*.jpg"))
    assert len(photographs) == 15
    assert [path.name for path in photographs if detect_tags(read_image(path))] == []
