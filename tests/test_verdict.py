"""What the verdict says about light, sharpness, tags, eyes and fruit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from drawn_tags import IMAGE_CORNERS, draw_tag

from fieldcam.values import (
    Calibration,
    DisparityWindow,
    Expectation,
    Flag,
    Fruitlet,
    ImageU8,
    Mask,
    ReasonCode,
    Region,
    Status,
    StereoPair,
    TagPose,
)
from fieldcam.vision.evidence import Evidence, Quality
from fieldcam.vision.eye_matches import EyeMatches, match_eyes
from fieldcam.vision.judging import judge
from fieldcam.vision.quality import measure_quality
from fieldcam.vision.sharpness import edge_blur_px, tag_blur_px
from fieldcam.vision.tags import detect_tags

CAMERA = Calibration(1440, 1080, 1717.0, 719.5, 539.5, 60.0)
TAG_MM = 27.95
GAMMA_BIAS = -0.0055
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def make_tag(
    x_mm: float = 0.0, y_mm: float = 0.0, z_mm: float = 440.0, tag_id: int = 17
) -> TagPose:
    """A tag that faces the left eye."""
    scale = CAMERA.focal_px / z_mm
    u, v = CAMERA.cx_px + x_mm * scale, CAMERA.cy_px + y_mm * scale
    half = TAG_MM / 2 * scale
    corners = tuple((u + half * float(a), v + half * float(b)) for a, b in IMAGE_CORNERS)
    return TagPose(tag_id, (u, v), corners, (x_mm, y_mm, z_mm), IDENTITY, 60.0)


def in_right(tag: TagPose, rows_px: float = 0.0, wider: float = GAMMA_BIAS) -> TagPose:
    """The same tag in the right eye, some rows lower, with a disparity that is off."""
    assert tag.range_mm is not None
    # A side measured by triangulation goes with the inverse of the disparity.
    shift = CAMERA.disparity_px(tag.range_mm) / (1 + wider)
    corners = tuple((x - shift, y + rows_px) for x, y in tag.corners_px)
    u, v = tag.center_px
    return replace(tag, center_px=(u - shift, v + rows_px), corners_px=corners, translation_mm=None)


def spots(
    rows_px: float = 0.0, disparity_px: float = 234.0, found: int = 20, slope: float = 0.0
) -> EyeMatches:
    """Spots at many depths; `slope`: rows for each pixel of disparity."""
    disparities = disparity_px * np.linspace(0.6, 1.1, found)
    rows = rows_px + slope * disparities
    return EyeMatches(24, np.column_stack((disparities, rows)))


def make_fruitlet(
    center_px: tuple[float, float] = (860.0, 540.0),
    flags: tuple[Flag, ...] = (),
    in_target: bool = True,
) -> Fruitlet:
    x, y = center_px
    mask = Mask(int(x) - 18, int(y) - 18, np.ones((36, 36), np.bool_))
    box = (x - 18, y - 18, x + 18, y + 18)
    return Fruitlet(
        id=0, in_target=in_target, diameter_mm=9.0, center_px=center_px, box_px=box, score=0.9,
        disparity_px=234.0, range_mm=440.0, visible_fraction=0.9, flags=flags, mask=mask,
        outline=None, cluster=0, centroid_mm=(0.0, 0.0, 440.0),
        cloud_mm=np.zeros((0, 3), np.float32),
    )  # fmt: skip


GOOD_QUALITY = Quality(
    fruit_brightness=120.0, white_level=170.0, right_white_ratio=1.0, clipped_share=0.0,
    tag_blur_px=1.1, edge_blur_px=0.8, depth_share=0.97, eyes=spots(),
)  # fmt: skip


def evidence(**changes: object) -> Evidence:
    """A good pair's evidence; names of Quality's fields change its quality."""
    given: dict[str, Any] = dict(changes)
    measures = {k: given.pop(k) for k in changes if k in Quality.__dataclass_fields__}
    tag = given.get("tag", make_tag())
    parts: dict[str, Any] = {
        "tag": tag,
        "right_tag": None if tag is None else in_right(tag),
        "tags_seen": () if tag is None else (tag,),
        "expectation": Expectation(17, 3),
        "fruitlets": (make_fruitlet(), make_fruitlet((870, 580)), make_fruitlet((900, 540))),
        "calibration": CAMERA,
        "region": Region(360, 180, 1080, 900),
        "quality": replace(GOOD_QUALITY, **measures),
        "tag_size_mm": TAG_MM,
    }
    return Evidence(**(parts | given))


def codes(found: Evidence) -> set[str]:
    return {reason.code.value for reason in judge(found).reasons}


def test_a_good_pair_is_accepted() -> None:
    verdict = judge(evidence())
    assert verdict.status is Status.ACCEPT
    assert verdict.reasons == ()


UNREAD: dict[str, Any] = {"tag": None, "right_tag": None, "tag_blur_px": None}
CASES: list[tuple[str, dict[str, Any], Status, set[str]]] = [
    ("dark fruit", {"fruit_brightness": 35.0}, Status.RETAKE, {"too_dark"}),
    ("dim fruit", {"fruit_brightness": 65.0}, Status.ACCEPT, set()),
    ("one eye dark", {"right_white_ratio": 0.2}, Status.RETAKE, {"too_dark"}),
    (
        "all dark", UNREAD | {"fruit_brightness": None, "white_level": 20.0, "fruitlets": ()},
        Status.RETAKE, {"too_dark", "no_tag"},
    ),
    ("clipped fruit", {"clipped_share": 0.6}, Status.RETAKE, {"overexposed"}),
    ("a glint", {"clipped_share": 0.1}, Status.ACCEPT, set()),
    (
        "white-out",
        UNREAD | {"fruit_brightness": None, "clipped_share": 0.5, "fruitlets": ()},
        Status.RETAKE, {"overexposed", "no_tag"},
    ),
    ("blurred tag", {"tag_blur_px": 3.0}, Status.RETAKE, {"blurred"}),
    ("soft edges but a sharp tag", {"edge_blur_px": 2.5}, Status.ACCEPT, set()),
    ("unread and blurred", UNREAD | {"edge_blur_px": 2.6}, Status.RETAKE, {"blurred", "no_tag"}),
    ("unread, sharp", UNREAD, Status.RETAKE, {"no_tag"}),
    ("wrong tag", {"expectation": Expectation(5, 3)}, Status.RETAKE, {"wrong_tag"}),
    (
        "two tags, none due",
        {"expectation": Expectation(None, 3), "tags_seen": (make_tag(), make_tag(tag_id=4))},
        Status.CONFIRM, {"several_tags"},
    ),
    (
        "two tags, one due", {"tags_seen": (make_tag(), make_tag(tag_id=4))},
        Status.ACCEPT, set(),
    ),
    (
        "the due tag twice", {"tags_seen": (make_tag(), make_tag(60.0))},
        Status.CONFIRM, {"several_tags"},
    ),
    ("near", {"tag": make_tag(z_mm=250.0)}, Status.RETAKE, {"too_near"}),
    ("far", {"tag": make_tag(z_mm=700.0)}, Status.RETAKE, {"too_far"}),
    ("fewer", {"expectation": Expectation(17, 5)}, Status.CONFIRM, {"fewer_than_before"}),
    ("more", {"expectation": Expectation(17, 2)}, Status.ACCEPT, set()),
    ("no fruit", {"fruitlets": (), "fruit_brightness": None}, Status.RETAKE, {"no_fruitlets"}),
    (
        "fruit without depth",
        {"fruitlets": (make_fruitlet(in_target=False),), "depth_share": 0.1},
        Status.RETAKE, {"no_depth"},
    ),
    (
        "a target without depth",
        {
            "fruitlets": (make_fruitlet(flags=(Flag.NO_DEPTH,)),),
            "expectation": Expectation(17),
        },
        Status.RETAKE, {"no_depth"},
    ),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "status", "wanted"), [c[1:] for c in CASES],
                         ids=[c[0] for c in CASES])  # fmt: skip
def test_each_finding_has_its_reason(
    changes: dict[str, Any], status: Status, wanted: set[str]
) -> None:
    found = evidence(**changes)
    assert judge(found).status is status
    assert codes(found) == wanted


@pytest.mark.parametrize(
    ("rows_px", "wider", "status", "wanted"),
    [
        (0.3, GAMMA_BIAS, Status.ACCEPT, set()),
        (0.0, GAMMA_BIAS + 0.012, Status.ACCEPT, set()),
        (1.6, GAMMA_BIAS, Status.CONFIRM, {"calibration_drift"}),
        (-3.5, GAMMA_BIAS, Status.RETAKE, {"calibration_drift"}),
        (0.0, GAMMA_BIAS + 0.025, Status.CONFIRM, {"calibration_drift"}),
        (0.0, GAMMA_BIAS + 0.04, Status.RETAKE, {"calibration_drift"}),
        (0.0, GAMMA_BIAS - 0.025, Status.ACCEPT, set()),
        (15.0, GAMMA_BIAS, Status.RETAKE, {"mispaired"}),
        (0.0, 0.2, Status.RETAKE, {"mispaired"}),
        (4.0, 0.04, Status.RETAKE, {"mispaired"}),
        (0.0, -1.9, Status.RETAKE, {"swapped_eyes"}),
    ],
)
def test_the_tag_in_both_eyes_tells_drift_from_another_moment(
    rows_px: float, wider: float, status: Status, wanted: set[str]
) -> None:
    found = evidence(right_tag=in_right(make_tag(), rows_px, wider))
    assert judge(found).status is status
    assert codes(found) == wanted


@pytest.mark.parametrize("z_mm", [250.0, 700.0])
def test_out_of_range_a_tags_corners_prove_no_drift(z_mm: float) -> None:
    tag = make_tag(z_mm=z_mm)
    found = codes(evidence(tag=tag, right_tag=in_right(tag, 3.0, 0.05)))
    assert not found & {"calibration_drift", "mispaired"}


def test_an_overexposed_tag_proves_no_drift() -> None:
    found = evidence(right_tag=in_right(make_tag(), 0.0, 0.05), clipped_share=0.5)
    assert codes(found) == {"overexposed"}


def test_rows_that_grow_with_nearness_mean_another_moment() -> None:
    shifted = in_right(make_tag(), 4.0)
    assert codes(evidence(right_tag=shifted, eyes=spots(-4.0))) == {"calibration_drift"}
    assert codes(evidence(right_tag=shifted, eyes=spots(slope=-0.017))) == {"mispaired"}


@pytest.mark.parametrize(
    ("eyes", "wanted"),
    [
        (spots(), set()),
        (spots(disparity_px=-234.0), {"swapped_eyes"}),
        (spots(rows_px=20.0), {"mispaired"}),
        (spots(rows_px=3.0), {"calibration_drift"}),
        (spots(rows_px=0.8), set()),
        (spots(found=3), {"mispaired"}),
        (EyeMatches(2, np.zeros((0, 2))), set()),
    ],
)
def test_spots_speak_where_one_eye_does_not_read_the_tag(
    eyes: EyeMatches, wanted: set[str]
) -> None:
    assert codes(evidence(right_tag=None, eyes=eyes)) == wanted
    assert codes(evidence(**UNREAD, eyes=eyes)) == wanted | {"no_tag"}


@pytest.mark.parametrize(
    ("x_px", "y_px"), [(250.0, 540.0), (1425.0, 540.0), (860.0, 20.0), (860.0, 1065.0)]
)
def test_a_cluster_at_the_border_of_either_eye_is_cut(x_px: float, y_px: float) -> None:
    """The right eye sees nothing of the left one's first 234 columns."""
    scale = CAMERA.focal_px / 440.0
    toward = (np.array([x_px, y_px]) - (CAMERA.cx_px, CAMERA.cy_px)) / scale
    beside = toward - 35 * toward / np.linalg.norm(toward)
    found = evidence(
        tag=make_tag(float(beside[0]), float(beside[1])),
        fruitlets=(make_fruitlet((x_px, y_px)),),
        expectation=Expectation(17),
    )
    assert codes(found) == {"cut_by_border"}


def test_a_neighbour_at_the_border_does_not_matter() -> None:
    others = (*evidence().fruitlets, make_fruitlet((1430, 540), in_target=False))
    assert codes(evidence(fruitlets=others)) == set()


@pytest.mark.parametrize(
    ("gap_mm", "found", "wanted"),
    [
        (15.0, True, {"cut_by_border"}),
        (30.0, True, set()),
        (30.0, False, {"cut_by_border"}),
        (60.0, False, {"no_fruitlets"}),
    ],
)
def test_a_tag_at_the_border_has_its_cluster_cut(
    gap_mm: float, found: bool, wanted: set[str]
) -> None:
    scale = CAMERA.focal_px / 440.0
    tag = make_tag((CAMERA.width_px - 1 - CAMERA.cx_px) / scale - gap_mm)
    inwards = make_fruitlet((tag.center_px[0] - 60.0, tag.center_px[1]))
    fruitlets = (inwards,) if found else ()
    assert codes(evidence(tag=tag, fruitlets=fruitlets, expectation=Expectation(17))) == wanted


def test_a_distant_fruitlet_without_depth_is_not_the_clusters() -> None:
    far_off = make_fruitlet((1300, 900), in_target=False)
    assert codes(evidence(fruitlets=(far_off,), depth_share=0.0)) == {"no_fruitlets"}


@pytest.mark.parametrize(("lost", "wanted"), [(1, set[str]()), (2, {"no_depth"})])
def test_fruitlets_beside_the_tag_without_depth_ask_for_a_retake(
    lost: int, wanted: set[str]
) -> None:
    measured = (make_fruitlet(), make_fruitlet((870, 580)))
    blind = (make_fruitlet((800 + 40 * i, 600), (Flag.NO_DEPTH,), False) for i in range(lost))
    found = evidence(fruitlets=(*measured, *blind), expectation=Expectation(17))
    assert codes(found) == wanted


def test_every_reason_says_what_to_do_in_one_short_sentence() -> None:
    texts = [r.text for _, changes, _, _ in CASES for r in judge(evidence(**changes)).reasons]
    assert texts
    for text in texts:
        assert len(text) < 80
        assert text.endswith((".", "?"))


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
    assert judge(found).reasons[0].code is expected


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_the_simulators_leaf_hides_the_tag_from_both_eyes(share: float) -> None:
    pytest.importorskip("embreex")
    from fieldcam.simulator import Block, Faults
    from fieldcam.simulator.capture import calibration_of, draw_shot
    from fieldcam.simulator.scene import build_scene, with_covered_tag
    from fieldcam.simulator.sightline import hiding_the_tag

    block = Block.plan(6_000_090, 1)
    plan, camera = block.clusters[0], calibration_of(block)
    covered = with_covered_tag(build_scene(plan, 0.0), share)
    shot = draw_shot(plan, covered, 0.0, 0, camera, Faults())
    leaf = len(covered.meshes) - 1
    for eye_x_mm in (0.0, camera.baseline_mm):
        hiding = hiding_the_tag(covered, shot.pose, (eye_x_mm,))
        assert leaf in hiding
