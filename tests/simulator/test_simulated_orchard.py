"""The simulated orchard: planned from seeds, true to its geometry, cheap in triangles."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("embreex", reason="the simulator extra is not installed")

from fieldcam.simulator.capture import CALIBRATIONS, _raw_pair, draw_shot, expose
from fieldcam.simulator.faults import Faults, Spoiling
from fieldcam.simulator.mesh import MeshPart, join
from fieldcam.simulator.plan import BlockPlan
from fieldcam.simulator.render import EyeView, Renderer
from fieldcam.simulator.scene import build_scene
from fieldcam.simulator.shapes import fruitlet
from fieldcam.simulator.texture import tag_image
from fieldcam.simulator.truth import disparity, matched, true_fruitlets
from fieldcam.values import Region

CALIBRATION = CALIBRATIONS[0]
WINDOW = Region(560, 380, 880, 700)


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return posed(seed=41)


@pytest.fixture(scope="module")
def left(renderer: Renderer) -> EyeView:
    return renderer.view(0.0, WINDOW)


def posed(seed: int) -> Renderer:
    plan = BlockPlan.plan(seed, 1).clusters[0]
    scene = build_scene(plan, 0.0)
    shot = draw_shot(plan, scene, 0.0, 0, CALIBRATION, Faults())
    return Renderer(scene, shot.pose, CALIBRATION, shot.light)


@given(seed=st.integers(0, 10**6))
def test_a_block_is_the_same_from_the_same_seed(seed: int) -> None:
    assert BlockPlan.plan(seed, 3) == BlockPlan.plan(seed, 3)


@given(seed=st.integers(0, 10**6), day=st.floats(0, 10))
def test_fruitlets_keep_within_what_the_field_shows(seed: int, day: float) -> None:
    for cluster in BlockPlan.plan(seed, 2).clusters:
        assert 3 <= len(cluster.fruitlets) <= 7
        for one in cluster.fruitlets:
            assert one.diameter_mm(day + 1) >= one.diameter_mm(day) >= 4.0
            assert one.diameter_mm(day + 1) - one.diameter_mm(day) <= 1.2 + 1e-9
            assert not (one.persists and np.isfinite(one.falls_on_day))


def test_late_growth_tells_persisting_fruitlets_and_early_growth_does_not() -> None:
    fruitlets = [f for s in range(80) for c in BlockPlan.plan(s, 5).clusters for f in c.fruitlets]
    stay = np.array([f.persists for f in fruitlets])
    early = np.array([f.early_rate_mm_per_day for f in fruitlets])
    late = np.array([f.late_rate_mm_per_day for f in fruitlets])
    assert (late[stay].mean() - late[~stay].mean()) > 4 * late[stay].std()
    assert (early[stay].mean() - early[~stay].mean()) < 2 * early[stay].std()


@pytest.mark.parametrize("view", [(0, 0, 1), (1, 0, 0), (0.6, 0.2, 0.77)])
def test_short_axis_of_a_silhouette_is_the_diameter(view: tuple[float, float, float]) -> None:
    mesh = fruitlet(12.0, 1.12, np.full((3, 3), 0.5, np.float32), 0.0, 0)
    axis = np.array(view) / np.linalg.norm(view)
    first = np.cross(axis, [0.3, 0.9, 0.1])
    first /= np.linalg.norm(first)
    flat = mesh.vertices_mm @ np.stack([first, np.cross(axis, first)], axis=1)
    turned = [np.ptp(flat @ [np.cos(a), np.sin(a)]) for a in np.linspace(0, np.pi, 360)]
    assert min(turned) == pytest.approx(12.0, rel=0.004)


def test_scenes_stay_within_the_triangle_budget() -> None:
    counts = [
        len(join(build_scene(BlockPlan.plan(s, 1).clusters[0], 0).meshes).triangles)
        for s in range(6)
    ]
    assert max(counts) <= 300_000


def test_normals_point_out_of_a_fruitlet() -> None:
    mesh = fruitlet(10.0, 1.1, np.full((3, 3), 0.5, np.float32), 0.0, 0)
    assert (np.sum(mesh.normals * mesh.vertices_mm, axis=1) > 0).mean() > 0.95


def test_disparity_finds_the_same_surface_in_the_other_eye(
    renderer: Renderer, left: EyeView
) -> None:
    d = disparity(renderer, left)
    whole_right = Region(0, WINDOW.y0, CALIBRATION.width_px, WINDOW.y1)
    right = renderer.view(CALIBRATION.baseline_mm, whole_right)
    seen = matched(renderer, left, right, 0.0, CALIBRATION.baseline_mm)
    by_rays = np.zeros_like(seen)
    found = np.isfinite(left.depth_mm)
    by_rays[found] = renderer.seen_from(renderer.points_mm(left)[found], CALIBRATION.baseline_mm)
    assert (seen == by_rays).mean() > 0.999
    inner = cv2.erode((left.fruitlet >= 0).astype(np.uint8), np.ones((5, 5))).astype(bool) & seen
    rows, columns = np.nonzero(inner)
    there = np.round(columns + WINDOW.x0 - d[rows, columns]).astype(int)
    assert len(rows) > 200
    assert (right.fruitlet[rows, there] == left.fruitlet[rows, columns]).mean() > 0.99
    assert np.median(np.abs(right.depth_mm[rows, there] - left.depth_mm[rows, columns])) < 0.3


def test_visible_masks_lie_inside_whole_ones_and_do_not_overlap(
    renderer: Renderer, left: EyeView
) -> None:
    taken = np.zeros((WINDOW.height, WINDOW.width), int)
    known = true_fruitlets(renderer, left)
    assert known
    for one in known:
        assert not (one.visible.window & ~one.whole.window).sum() > 0.02 * one.whole.area_px
        rows, columns = one.visible.region.slices
        place = (
            slice(rows.start - WINDOW.y0, rows.stop - WINDOW.y0),
            slice(columns.start - WINDOW.x0, columns.stop - WINDOW.x0),
        )
        taken[place] += one.visible.window
    assert taken.max() == 1


def test_equal_seeds_give_equal_pixels() -> None:
    plan = BlockPlan.plan(5, 1).clusters[0]
    scene = build_scene(plan, 2.0)
    region = Region(600, 400, 680, 480)
    pictures = []
    for _ in range(2):
        shot = draw_shot(plan, scene, 2.0, 0, CALIBRATION, Faults())
        eyes = Renderer(scene, shot.pose, CALIBRATION, shot.light)
        views = [eyes.view(x, region) for x in (0.0, CALIBRATION.baseline_mm)]
        pictures.append(expose(shot, views[0], views[1], CALIBRATION))
    assert np.array_equal(pictures[0][0], pictures[1][0])
    assert np.array_equal(pictures[0][1], pictures[1][1])


@pytest.mark.parametrize(("kind", "darker"), [(Spoiling.DARK, True), (Spoiling.OVEREXPOSED, False)])
def test_faults_change_the_exposure_in_order_of_severity(kind: Spoiling, darker: bool) -> None:
    plan = BlockPlan.plan(5, 1).clusters[0]
    scene = build_scene(plan, 0.0)
    exposures = [
        draw_shot(plan, scene, 0.0, 0, CALIBRATION, Faults(kind, s)).sensor.exposure
        for s in range(1, 6)
    ]
    assert exposures == sorted(exposures, reverse=darker)


def test_no_two_pictures_of_a_day_have_the_same_time() -> None:
    eyes = (np.zeros((4, 6, 3), np.uint8),) * 2
    times = {_raw_pair(eyes, 2, n, view).taken_at for n in range(30) for view in range(10)}
    assert len(times) == 300


def test_the_printed_tag_reads_as_its_id() -> None:
    from pupil_apriltags import Detector

    print_u8 = np.pad((tag_image(17) * 255).astype(np.uint8), 40, constant_values=255)
    assert [found.tag_id for found in Detector(families="tag36h11").detect(print_u8)] == [17]


def test_the_scene_has_all_that_the_field_has() -> None:
    parts = {
        MeshPart(m.part)
        for s in range(4)
        for m in build_scene(BlockPlan.plan(s, 1).clusters[0], 0).meshes
    }
    assert parts == set(MeshPart)
