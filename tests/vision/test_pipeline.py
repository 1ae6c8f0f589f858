"""The whole flow on drawn scenes, with perfect stand-ins for the networks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from drawn_fruit import CAMERA, Drawn, Fruit, draw

from fieldcam.values import (
    Calibration,
    ClusterReading,
    DisparityWindow,
    Expectation,
    Flag,
    FloatMap,
    ImageU8,
    Matcher,
    Method,
    ReasonCode,
    Region,
    Settings,
    Status,
    StereoPair,
    TagPose,
)
from fieldcam.vision.pipeline import Pipeline
from fieldcam.vision.regions import around_tag
from fieldcam.vision.segmentation import Segmented

TAG_MM = (0.0, 0.0, 440.0)
NEAR = [
    Fruit((45.0, 0.0, 440.0), 9.0, 1.1),
    Fruit((60.0, 14.0, 446.0), 11.0, 1.05),
    Fruit((62.0, -13.0, 437.0), 8.0, 1.1, (1.0, 0.3, 0.2)),
    Fruit((44.0, 20.0, 450.0), 10.0),
]
FAR = [Fruit((-75.0, -60.0, 470.0), 9.0), Fruit((-66.0, -50.0, 480.0), 10.0)]
STAGES = {"tags", "segmentation", "stereo", "clouds", "clustering", "sizing", "judge", "total"}


def tag_pose(tag_id: int = 17, center_mm: tuple[float, float, float] = TAG_MM) -> TagPose:
    x, y, z = center_mm
    half = 27.95 / 2 * CAMERA.focal_px / z
    u, v = CAMERA.focal_px * x / z + CAMERA.cx_px, CAMERA.focal_px * y / z + CAMERA.cy_px
    corners = (
        (u - half, v + half),
        (u + half, v + half),
        (u + half, v - half),
        (u - half, v - half),
    )
    identity = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return TagPose(tag_id, (u, v), corners, center_mm, identity, 60.0)


@dataclass
class DrawnTags:
    """Reads the given tags in the left eye, and the same at their disparity in the right."""

    tags: Sequence[TagPose]

    def __call__(
        self, image: ImageU8, calibration: Calibration | None = None, tag_size_mm: float = 27.95
    ) -> tuple[TagPose, ...]:
        if calibration is not None:
            return tuple(self.tags)
        # The right eye is searched in crops.
        x0, y0 = origin(image)
        return tuple(_shifted(t, x0, y0) for t in self.tags)


def _shifted(tag: TagPose, x0: int, y0: int) -> TagPose:
    assert tag.range_mm is not None
    dx, dy = CAMERA.disparity_px(tag.range_mm) + x0, y0
    corners = tuple((x - dx, y - dy) for x, y in tag.corners_px)
    u, v = tag.center_px
    return replace(tag, center_px=(u - dx, v - dy), corners_px=corners, translation_mm=None)


@dataclass
class DrawnInstances:
    """Gives the drawn masks of a region and keeps which region was asked for."""

    drawn: Drawn
    region: Region | None = None

    def segment(self, image: ImageU8, region: Region | None = None) -> Segmented:
        assert region is not None
        self.region = region
        inside = []
        for instance in self.drawn.instances:
            box = instance.visible.region
            if region.x0 <= box.x0 and box.x1 <= region.x1 and region.y0 <= box.y0:
                inside.append(instance)
        return Segmented(tuple(inside), ((12.0, 34.5),))


@dataclass
class DrawnDisparity:
    """Looks the residual up; the crops' columns tell where they come from."""

    truth: FloatMap
    search_px: float = 64.0
    scale: float = 1.0
    offsets: list[int] = field(default_factory=list)

    def spanning(self, search_px: float) -> DrawnDisparity:
        return DrawnDisparity(self.truth, search_px, self.scale, self.offsets)

    def match(self, left: ImageU8, right: ImageU8) -> FloatMap:
        x0, y0 = origin(left)
        # The last column is never one that the right image's border was repeated for.
        offset = origin(left[:, -1:])[0] - origin(right[:, -1:])[0]
        self.offsets.append(offset)
        height, width = left.shape[:2]
        region = Region(x0, y0, x0 + width, y0 + height)
        residual = self.truth[region.slices] - offset
        return np.where(np.abs(residual) <= self.search_px, residual, np.nan).astype(np.float32)


def coordinate_pair() -> StereoPair:
    """A pair in which every pixel tells its place."""
    rows, columns = np.mgrid[0 : CAMERA.height_px, 0 : CAMERA.width_px]
    high = (columns >> 8) + (rows >> 8 << 4)
    image = np.stack([columns & 255, rows & 255, high], axis=-1).astype(np.uint8)
    return StereoPair(image, image.copy())


def origin(crop: ImageU8) -> tuple[int, int]:
    """Column and row that a crop of such an image starts at."""
    column, row, high = (int(v) for v in crop[0, 0])
    return column + ((high & 15) << 8), row + (high >> 4 << 8)


def analyse(
    fruits: Sequence[Fruit],
    tags: Sequence[TagPose] = (tag_pose(),),
    expectation: Expectation | None = None,
    settings: Settings | None = None,
) -> ClusterReading:
    drawn = draw(fruits)
    matcher = DrawnDisparity(drawn.window.disparity_px)
    pipeline = Pipeline(
        DrawnInstances(drawn), {m: matcher for m in Matcher}, {"stereo": "ab"},
        read_tags=DrawnTags(tags),
    )  # fmt: skip
    return pipeline.analyse(coordinate_pair(), CAMERA, expectation, settings)


def test_the_cluster_beside_the_tag_is_found_and_sized() -> None:
    reading = analyse(NEAR + FAR, expectation=Expectation(17, 4))
    assert reading.tag is not None
    assert [f.in_target for f in reading.fruitlets] == [True] * 4 + [False] * 2
    for fruitlet, truth in zip(reading.fruitlets, NEAR + FAR, strict=True):
        assert fruitlet.diameter_mm == pytest.approx(truth.diameter_mm, abs=0.15)
        assert fruitlet.flags == ()
        assert fruitlet.centroid_mm is not None
        assert np.linalg.norm(np.array(fruitlet.centroid_mm) - truth.center_mm) < 6
        assert len(fruitlet.cloud_mm) > 20
    assert {f.cluster for f in reading.target} != {f.cluster for f in reading.fruitlets[4:]}


def test_a_reading_says_how_it_was_made() -> None:
    reading = analyse(NEAR)
    assert set(reading.timing_ms) == STAGES
    parts = sum(v for k, v in reading.timing_ms.items() if k != "total")
    assert parts <= reading.timing_ms["total"]
    assert reading.models == {"stereo": "ab"}
    assert reading.software_version
    assert reading.window is not None
    assert reading.window.region == around_tag(tag_pose(), CAMERA, 1440, 1080)


def test_the_region_is_180_mm_wide_around_the_tag_and_clipped() -> None:
    region = around_tag(tag_pose(), CAMERA, 1440, 1080)
    assert region.width == region.height
    assert 180 <= region.width * 440 / CAMERA.focal_px < 190
    assert region.width % 32 == 0
    corner = around_tag(tag_pose(center_mm=(-150.0, -110.0, 440.0)), CAMERA, 1440, 1080)
    assert (corner.x0, corner.y0) == (0, 0)


def test_the_tags_range_gives_the_offset() -> None:
    drawn = draw(NEAR)
    matcher = DrawnDisparity(drawn.window.disparity_px)
    pipeline = Pipeline(
        DrawnInstances(drawn), {Matcher.RAFT: matcher}, read_tags=DrawnTags([tag_pose()])
    )
    pipeline.analyse(coordinate_pair(), CAMERA)
    assert matcher.offsets == [round(CAMERA.disparity_px(440.0))]


def test_without_a_tag_fruitlets_are_reported_and_a_retake_is_asked_for() -> None:
    reading = analyse(NEAR, tags=())
    assert len(reading.fruitlets) == 4
    assert reading.target == ()
    assert reading.verdict.status is Status.RETAKE
    assert ReasonCode.NO_TAG in {r.code for r in reading.verdict.reasons}
    assert all(f.diameter_mm is not None for f in reading.fruitlets)


@pytest.mark.parametrize("settings", [Settings(whole_image=True), Settings(method=Method.PAPER)])
def test_whole_image_modes_search_the_whole_image(settings: Settings) -> None:
    reading = analyse(NEAR + FAR, settings=settings)
    assert reading.window is not None
    assert reading.window.region == Region(0, 0, 1440, 1080)
    assert len(reading.target) == 4


def test_the_papers_method_gives_the_papers_bias() -> None:
    reading = analyse(NEAR, settings=Settings(method=Method.PAPER))
    errors = [
        f.diameter_mm - t.diameter_mm
        for f, t in zip(reading.fruitlets, NEAR, strict=True)
        if f.diameter_mm is not None
    ]
    assert len(errors) == 4
    assert -0.45 < np.mean(errors) < -0.1


def test_a_fruitlet_outside_the_searched_window_has_no_range_and_no_cluster() -> None:
    behind = Fruit((20.0, 30.0, 700.0), 20.0)
    drawn = draw([*NEAR, behind], wall_mm=900.0)
    matcher = DrawnDisparity(drawn.window.disparity_px)
    pipeline = Pipeline(
        DrawnInstances(drawn), {Matcher.RAFT: matcher}, read_tags=DrawnTags([tag_pose()])
    )
    *_, last = pipeline.analyse(coordinate_pair(), CAMERA).fruitlets
    assert last.range_mm is None
    assert last.cluster is None
    assert last.centroid_mm is None
    assert last.diameter_mm is None
    assert Flag.NO_DEPTH in last.flags


def test_fewer_fruitlets_than_before_is_for_the_operator_to_confirm() -> None:
    reading = analyse(NEAR, expectation=Expectation(17, 6))
    assert ReasonCode.FEWER_THAN_BEFORE in {r.code for r in reading.verdict.reasons}


def test_the_expected_tag_counts_when_several_are_in_view() -> None:
    other = tag_pose(23, (-70.0, -55.0, 470.0))
    reading = analyse(NEAR + FAR, tags=(tag_pose(), other), expectation=Expectation(23))
    assert reading.tag is not None
    assert reading.tag.id == 23
    assert reading.tags_seen == (17, 23)
    assert reading.faint_px == ((12.0, 34.5),)
    assert [f.in_target for f in reading.fruitlets][-2:] == [True, True]


def test_an_empty_picture_has_a_verdict_too() -> None:
    reading = analyse([])
    assert reading.fruitlets == ()
    assert reading.verdict.status is Status.RETAKE
    assert isinstance(reading.window, DisparityWindow)
