"""One simulated capture of one tagged cluster, with the truth about it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from fieldcam.simulator.faults import SEVERITIES, Faults, Spoiling
from fieldcam.simulator.light import SceneLight
from fieldcam.simulator.mesh import F32
from fieldcam.simulator.plan import BlockPlan, ClusterPlan
from fieldcam.simulator.render import EyePose, EyeView, Renderer
from fieldcam.simulator.scene import Scene, build_scene, with_covered_tag
from fieldcam.simulator.sensor import Sensor
from fieldcam.simulator.sightline import hiding_the_tag
from fieldcam.simulator.truth import Truth, disparity, matched, true_fruitlets
from fieldcam.values import Calibration, ImageU8, PixelFormat, RawPair, Region, StereoPair

FIRST_DAY = datetime(2026, 5, 21, 9, 0, tzinfo=UTC)
SERIALS = ("SIM-LEFT", "SIM-RIGHT")
CALIBRATIONS = (
    Calibration(1440, 1080, 1705.08, 694.1, 513.2, 60.00),
    Calibration(1440, 1080, 1716.03, 732.9, 488.7, 60.18),
    Calibration(1440, 1080, 1701.10, 728.8, 488.5, 59.82),
    Calibration(1440, 1080, 1739.84, 790.9, 459.0, 60.20),
    Calibration(1440, 1080, 1769.98, 661.5, 522.7, 60.30),
)
"""Focal lengths, principal points and baselines of the authors' real camera."""

FRAMING = {Spoiling.TOO_NEAR, Spoiling.TOO_FAR, Spoiling.CUT_BY_BORDER, Spoiling.TAG_HIDDEN}
"""Faults of what is looked at; the others spoil how it is taken."""


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedCapture:
    """A rectified pair, as the camera would give it, and what is really there."""

    raw: RawPair
    calibration: Calibration
    truth: Truth

    @property
    def pair(self) -> StereoPair:
        return StereoPair(self.raw.left, self.raw.right)


@dataclass(frozen=True, slots=True, eq=False)
class RandomExposure:
    """Everything random about one exposure of one scene."""

    pose: EyePose
    light: SceneLight
    sensor: Sensor
    tilt_px: float
    """How far the right image sits too low: what rectification left over."""


def calibration_of(block: BlockPlan) -> Calibration:
    """The camera that a block is walked with."""
    return CALIBRATIONS[block.seed % len(CALIBRATIONS)]


@dataclass(frozen=True, slots=True, eq=False)
class Aim:
    """A cluster before the camera, ready to be rendered."""

    plan: ClusterPlan
    calibration: Calibration
    shot: RandomExposure
    renderer: Renderer


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """What both eyes see of a cluster, before light becomes pictures."""

    plan: ClusterPlan
    cluster_index: int
    day: float
    view: int
    calibration: Calibration
    shot: RandomExposure
    renderer: Renderer
    left: EyeView
    right: EyeView
    truth: Truth


def capture(
    block: BlockPlan, cluster_index: int, day: float, view: int = 0, faults: Faults | None = None
) -> SimulatedCapture:
    """Photograph a cluster of a block on a day; equal arguments give equal pixels."""
    faults = faults or Faults()
    return develop(look(block, cluster_index, day, view, faults), faults)


def look(block: BlockPlan, cluster_index: int, day: float, view: int, faults: Faults) -> Sight:
    """Aim at a cluster; of the faults only those in FRAMING make a difference here."""
    return both_eyes(aim(block, cluster_index, day, view, faults), cluster_index, day, view)


def both_eyes(aimed: Aim, cluster_index: int, day: float, view: int) -> Sight:
    """Look at what is before the camera through both eyes."""
    calibration, renderer = aimed.calibration, aimed.renderer
    region = Region.whole(*calibration.size_px)
    left, right = (renderer.view(x, region) for x in (0.0, calibration.baseline_mm))
    truth = _truth(renderer, left, right)
    return Sight(
        aimed.plan, cluster_index, day, view, calibration, aimed.shot, renderer, left, right, truth
    )


def aim(block: BlockPlan, cluster_index: int, day: float, view: int, faults: Faults) -> Aim:
    """Point the camera at a cluster and part the leaves before its tag."""
    plan = block.clusters[cluster_index]
    calibration = calibration_of(block)
    scene = build_scene(plan, day)
    framing = faults if faults.kind in FRAMING else Faults()
    shot = draw_shot(plan, scene, day, view, calibration, framing)
    scene = parted(scene, shot, calibration)
    if faults.kind is Spoiling.TAG_HIDDEN:
        scene = with_covered_tag(scene, faults.severity / max(SEVERITIES))
    return Aim(plan, calibration, shot, Renderer(scene, shot.pose, calibration, shot.light))


def develop(sight: Sight, faults: Faults) -> SimulatedCapture:
    """Expose both eyes, with the faults of light, lens, pairing or rectification."""
    shot = _spoiled(sight.shot, faults)
    other = _later(sight, faults)
    images = expose(shot, sight.left, other, sight.calibration)
    if faults.kind is Spoiling.SWAPPED_EYES:
        images = images[::-1]
    return SimulatedCapture(
        raw=_raw_pair(images, sight.day, sight.cluster_index, sight.view),
        calibration=sight.calibration,
        truth=sight.truth,
    )


def parted(scene: Scene, shot: RandomExposure, calibration: Calibration) -> Scene:
    """The scene after the operator's free hand has parted the leaves before the tag."""
    hiding = hiding_the_tag(scene, shot.pose, (0.0, calibration.baseline_mm))
    while hiding:
        kept = tuple(m for i, m in enumerate(scene.meshes) if i not in hiding)
        scene = replace(scene, meshes=kept)
        hiding = hiding_the_tag(scene, shot.pose, (0.0, calibration.baseline_mm))
    return scene


def draw_shot(
    plan: ClusterPlan, scene: Scene, day: float, view: int, calibration: Calibration, faults: Faults
) -> RandomExposure:
    """Aim, light and expose as an operator would, or as a fault makes it."""
    rng = np.random.default_rng([plan.seed, 4, round(day * 24), view])
    pose = _aim(rng, scene, calibration, faults)
    light = SceneLight.draw(rng, calibration.baseline_mm)
    sensor = Sensor.draw(rng)
    tilt_px = float(rng.normal(0, 0.15))
    return _spoiled(RandomExposure(pose, light, sensor, tilt_px), faults)


def expose(
    shot: RandomExposure, left: EyeView, right: EyeView, calibration: Calibration
) -> tuple[ImageU8, ImageU8]:
    """Both pictures (h, w, 3) of an exposure, each as large as its view."""
    sensors = (shot.sensor, shot.sensor.other_eye())
    pictures = []
    for sensor, view, shift in zip(sensors, (left, right), (0.0, shot.tilt_px), strict=True):
        center = (
            calibration.width_px / 2 - view.region.x0,
            calibration.height_px / 2 - view.region.y0,
        )
        radiance, depth = view.radiance, view.depth_mm
        if abs(shift) > 0.02:
            radiance = _shifted_rows(radiance, shift)
        pictures.append(sensor.expose(radiance, depth, center))
    return pictures[0], pictures[1]


def _shifted_rows(radiance: F32, shift_px: float) -> F32:
    matrix = np.array([[1, 0, 0], [0, 1, shift_px]], np.float32)
    size = (radiance.shape[1], radiance.shape[0])
    return np.asarray(
        cv2.warpAffine(
            radiance, matrix, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        ),
        np.float32,
    )


def _aim(
    rng: np.random.Generator, scene: Scene, calibration: Calibration, faults: Faults
) -> EyePose:
    """Point the camera so that the cluster and its tag stand near the image's middle."""
    range_mm = float(np.clip(rng.normal(438, 45), 345, 545))
    aside = rng.normal(0, 18, 2)
    if faults.kind is Spoiling.TOO_NEAR:
        range_mm = 300 - 22 * faults.severity
    if faults.kind is Spoiling.TOO_FAR:
        range_mm = 640 + 70 * faults.severity
    if faults.kind is Spoiling.CUT_BY_BORDER:
        half_mm = calibration.width_px / 2 / calibration.focal_px * range_mm
        aside = np.array([half_mm - 25 + 7 * faults.severity, 0]) * rng.choice([-1, 1])
    turn = Rotation.from_euler("yxz", rng.normal(0, [0.16, 0.13, 0.09])).as_matrix()
    middle = (0.5 * np.asarray(scene.tag_center_mm)).astype(np.float32)
    off_center = np.array(
        [
            (calibration.width_px / 2 - calibration.cx_px) / calibration.focal_px * range_mm
            + aside[0],
            (calibration.height_px / 2 - calibration.cy_px) / calibration.focal_px * range_mm
            + aside[1],
            range_mm,
        ]
    )
    rotation = turn.astype(np.float32)
    return EyePose(rotation, (off_center - rotation @ middle).astype(np.float32))


def _spoiled(shot: RandomExposure, faults: Faults) -> RandomExposure:
    """The same shot with its light, lens or rectification at fault."""
    sensor, bad = shot.sensor, faults.severity
    match faults.kind:
        case Spoiling.DARK:
            return replace(shot, sensor=replace(sensor, exposure=sensor.exposure * 0.1 / 2**bad))
        case Spoiling.OVEREXPOSED:
            return replace(shot, sensor=replace(sensor, exposure=3.0 + 2.0 * bad))
        case Spoiling.BLURRED:
            return replace(shot, sensor=replace(sensor, shake_px=4.0 + 4.0 * bad))
        case Spoiling.DEFOCUSED:
            return replace(shot, sensor=replace(sensor, lens_blur_px=2.0 + 1.0 * bad))
        case Spoiling.DRIFTED:
            return replace(shot, tilt_px=1.2 + 1.1 * bad)
        case _:
            return shot


def _later(sight: Sight, faults: Faults) -> EyeView:
    """The right view of this exposure, or of another one where the pair is mixed up."""
    if faults.kind is not Spoiling.MISPAIRED:
        return sight.right
    rng = np.random.default_rng([sight.plan.seed, 5, sight.view])
    slip = rng.normal(0, 1, 3) * np.array([4.0, 4.0, 3.0]) * faults.severity
    pose = sight.shot.pose
    moved = EyePose(pose.rotation, (pose.translation_mm + slip).astype(np.float32))
    renderer = Renderer(sight.renderer.scene, moved, sight.calibration, sight.shot.light)
    return renderer.view(sight.calibration.baseline_mm, sight.right.region)


def _truth(renderer: Renderer, left: EyeView, right: EyeView) -> Truth:
    scene, baseline = renderer.scene, renderer.calibration.baseline_mm
    tag = renderer.pose.apply(scene.tag_center_mm)
    return Truth(
        tag_id=scene.tag_id,
        tag_center_mm=(float(tag[0]), float(tag[1]), float(tag[2])),
        tag_rotation=(renderer.pose.rotation @ scene.tag_rotation).astype(np.float32),
        fruitlets=true_fruitlets(renderer, left),
        left_disparity_px=disparity(renderer, left),
        left_matched=matched(renderer, left, right, 0.0, baseline),
    )


def _raw_pair(images: tuple[ImageU8, ...], day: float, cluster_index: int, view: int) -> RawPair:
    # Far enough apart that the views of one cluster do not reach into the next ones' turn.
    taken = FIRST_DAY + timedelta(days=day, minutes=10 * view, seconds=20 * cluster_index)
    stamp = int(taken.timestamp() * 1e9)
    return RawPair(
        left=images[0],
        right=images[1],
        pixel_format=PixelFormat.RGB8,
        taken_at=taken,
        left_timestamp_ns=stamp,
        right_timestamp_ns=stamp,
        left_serial=SERIALS[0],
        right_serial=SERIALS[1],
        trigger_ordinal=cluster_index * 10 + view,
        simulated=True,
    )
