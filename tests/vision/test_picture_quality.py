"""What is measured of a pair before it is judged: blur, light, the eyes' agreement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from drawn_tags import IMAGE_CORNERS, draw_tag
from made_evidence import UNREAD, evidence, judged, make_fruitlet, make_tag

from fieldcam.values import (
    DisparityWindow,
    ImageU8,
    ReasonCode,
    Region,
    StereoPair,
    TagPose,
)
from fieldcam.vision.judging.eye_matches import match_eyes
from fieldcam.vision.judging.quality import measure_quality
from fieldcam.vision.judging.sharpness import edge_blur_px, tag_blur_px
from fieldcam.vision.tags.detection import detect_tags

TAG_CORNERS_PX = 100 + 55.0 * IMAGE_CORNERS


@pytest.fixture(scope="module")
def tag() -> TagPose:
    """Read on a sharp picture: how well it is read is not the question here."""
    (tag,) = detect_tags(draw_tag(TAG_CORNERS_PX, (200, 200)))
    return tag


def drawn(blur_px: float = 0.7, dark: float = 25.0, light: float = 215.0) -> ImageU8:
    return draw_tag(TAG_CORNERS_PX, (200, 200), blur_px=blur_px, dark=dark, light=light)


@pytest.mark.parametrize("blur_px", [0.7, 1.5, 2.5, 3.5])
def test_the_tags_edges_tell_the_blur(blur_px: float, tag: TagPose) -> None:
    clear, faint = drawn(blur_px), drawn(blur_px, 60.0, 110.0)
    for image in (clear, noisy(clear), faint):
        assert tag_blur_px(image, tag) == pytest.approx(blur_px, rel=0.2, abs=0.3)


@pytest.mark.parametrize("angle_rad", [0.0, 0.8, np.pi / 2])
def test_the_worst_direction_of_a_smear_counts(angle_rad: float, tag: TagPose) -> None:
    smear = tag_blur_px(smeared(drawn(), 11.0, angle_rad), tag)
    assert smear is not None
    assert smear > 2.2


def test_a_tag_without_contrast_tells_no_blur(tag: TagPose) -> None:
    assert tag_blur_px(np.full((200, 200), 90, np.uint8), tag) is None


def texture(seed: int = 1, shape: tuple[int, int] = (480, 720)) -> ImageU8:
    """Discs of all sizes and greys: edges in every direction."""
    rng = np.random.default_rng(seed)
    image = np.full(shape, 90, np.uint8)
    for _ in range(400):
        x, y = rng.integers(0, shape[1]), rng.integers(0, shape[0])
        cv2.circle(
            image, (int(x), int(y)), int(rng.integers(3, 30)), int(rng.integers(20, 230)), -1
        )
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 0.7), np.uint8)


def smeared(image: ImageU8, length_px: float, angle_rad: float) -> ImageU8:
    side = 2 * int(length_px) + 1
    path = np.zeros((side, side), np.float32)
    for step in np.linspace(-0.5, 0.5, 400) * length_px:
        x, y = side // 2 + step * np.cos(angle_rad), side // 2 + step * np.sin(angle_rad)
        path[round(y), round(x)] += 1
    return np.asarray(cv2.filter2D(image, -1, path / path.sum()), np.uint8)


def noisy(image: ImageU8) -> ImageU8:
    noise = np.random.default_rng(2).normal(0, 8, image.shape)
    return np.asarray(np.clip(image + noise, 0, 255), np.uint8)


Spoil = Callable[[ImageU8], ImageU8]


@pytest.mark.parametrize(
    ("spoil", "blurred"),
    [
        (lambda i: i, False),
        (noisy, False),
        (lambda i: (i // 4 + 60).astype(np.uint8), False),
        (lambda i: cv2.GaussianBlur(i, (0, 0), 2.5), True),
        (lambda i: smeared(i, 10.0, 0.0), True),
        (lambda i: smeared(i, 10.0, 0.7), True),
    ],
    ids=["sharp", "noisy", "low contrast", "defocused", "smeared", "smeared aslant"],
)
def test_any_edges_tell_the_blur(spoil: Spoil, blurred: bool) -> None:
    blur = edge_blur_px(spoil(texture()))
    assert blur is not None
    assert (blur > 1.9) == blurred


def test_an_empty_picture_has_no_edges() -> None:
    assert edge_blur_px(np.full((200, 200), 30, np.uint8)) is None


def moved(image: ImageU8, left_px: float, down_px: float) -> ImageU8:
    matrix = np.array([[1, 0, -left_px], [0, 1, down_px]], np.float32)
    size = (image.shape[1], image.shape[0])
    return np.asarray(cv2.warpAffine(image, matrix, size), np.uint8)


@pytest.mark.parametrize("shift", [(90.0, 0.0), (-90.0, 0.0), (60.0, 3.5), (60.0, -25.0)])
def test_spots_are_found_again_to_a_fraction_of_a_pixel(shift: tuple[float, float]) -> None:
    left = texture()
    found = match_eyes(left, moved(left, *shift), Region(200, 60, 520, 420))
    assert found.found_share > 0.7
    np.testing.assert_allclose(np.median(found.shifts_px, axis=0), (shift[0], -shift[1]), atol=0.3)
    assert found.swapped_share == float(shift[0] < 0)


def test_spots_of_another_scene_are_not_found() -> None:
    found = match_eyes(texture(1), texture(2), Region(200, 60, 520, 420))
    assert found.found_share < 0.2


def test_a_pair_is_measured_on_its_fruit() -> None:
    grey = texture()
    grey[100:136, 300:336] = 250
    pair = StereoPair(np.dstack([grey] * 3), np.dstack([moved(grey, 90.0, 0.0)] * 3))
    region = Region(200, 60, 520, 420)
    disparity: npt.NDArray[np.float32] = np.full((360, 320), 90.0, np.float32)
    disparity[:58] = np.nan
    fruitlet = make_fruitlet((318.0, 118.0))
    quality = measure_quality(pair, region, make_tag(), DisparityWindow(region, disparity),
                              (fruitlet,))  # fmt: skip
    assert quality.fruit_brightness == pytest.approx(250.0)
    assert quality.clipped_share == pytest.approx(1.0)
    assert quality.depth_share == pytest.approx(0.5)
    assert quality.right_white_ratio == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("grey", [0, 255])
def test_a_black_or_white_frame_has_a_reason(grey: int) -> None:
    image = np.full((1080, 1440, 3), grey, np.uint8)
    region = Region(0, 0, 1440, 1080)
    window = DisparityWindow(region, np.full((1080, 1440), np.nan, np.float32))
    quality = measure_quality(StereoPair(image, image), region, None, window, ())
    found = replace(evidence(**UNREAD, fruitlets=()), quality=quality)
    expected = ReasonCode.TOO_DARK if grey == 0 else ReasonCode.OVEREXPOSED
    assert judged(found).reasons[0].code is expected


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_the_simulators_leaf_hides_the_tag_from_both_eyes(share: float) -> None:
    pytest.importorskip("embreex")
    from fieldcam.simulator import BlockPlan, Faults
    from fieldcam.simulator.capture import calibration_of, draw_shot
    from fieldcam.simulator.scene import build_scene, with_covered_tag
    from fieldcam.simulator.sightline import hiding_the_tag

    block = BlockPlan.plan(6_000_090, 1)
    plan, camera = block.clusters[0], calibration_of(block)
    covered = with_covered_tag(build_scene(plan, 0.0), share)
    shot = draw_shot(plan, covered, 0.0, 0, camera, Faults())
    leaf = len(covered.meshes) - 1
    for eye_x_mm in (0.0, camera.baseline_mm):
        hiding = hiding_the_tag(covered, shot.pose, (eye_x_mm,))
        assert leaf in hiding
