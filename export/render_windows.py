"""Renders the windows of the simulated orchard that both networks train on.

One file for each window, named by its seed: `python -m export.render_windows
--out DIR --first 0 --count 1000`. A file that exists is not rendered again.
Seeds below 1,000,000 are for training, those from 9,000,000 on for validation
while training; the published figures come from blocks of their own.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from export.wild_scenes import wild_light, wild_plan, wild_scene
from fieldcam.simulator.capture import RandomExposure, calibration_of, draw_shot, expose
from fieldcam.simulator.faults import Faults
from fieldcam.simulator.mesh import F32
from fieldcam.simulator.plan import BlockPlan
from fieldcam.simulator.render import Renderer
from fieldcam.simulator.scene import Scene, build_scene
from fieldcam.simulator.sensor import Sensor
from fieldcam.simulator.truth import disparity, matched, true_fruitlets
from fieldcam.values import Calibration, Region

SIDE_PX = 448
DAYS = (0.0, 1.0, 2.0, 4.0, 6.0, 8.0)
POSES_PER_SCENE = 2
WINDOWS_PER_POSE = 2


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """One training sample; the arrays are those of the file."""

    left: npt.NDArray[np.uint8]
    right: npt.NDArray[np.uint8]
    offset_px: int
    disparity: F32
    noc: npt.NDArray[np.bool_]
    labels: npt.NDArray[np.uint8]
    whole: npt.NDArray[np.bool_]
    diameter_mm: F32

    def save(self, path: Path) -> None:
        """Write the file in one step, so that a reader never sees half of it."""
        temporary = path.with_suffix(".part")
        with temporary.open("wb") as file:
            np.savez(
                file, left=self.left, right=self.right, offset_px=np.int32(self.offset_px),
                disparity=self.disparity, noc=self.noc, labels=self.labels,
                whole=np.packbits(self.whole, axis=-1), diameter_mm=self.diameter_mm,
            )  # fmt: skip
        temporary.replace(path)


def scene_windows(seed: int, wild: bool) -> Iterator[Window]:
    """All windows of one random scene."""
    rng = np.random.default_rng([seed, 77])
    block = BlockPlan.plan(seed, 1)
    plan = wild_plan(seed) if wild else block.clusters[0]
    calibration = calibration_of(block)
    scene = wild_scene(plan, rng) if wild else build_scene(plan, float(rng.choice(DAYS)))
    for pose_index in range(POSES_PER_SCENE):
        shot = draw_shot(plan, scene, 0, pose_index, calibration, Faults())
        if wild:
            shot = replace(shot, light=wild_light(shot.light, rng))
        renderer = Renderer(scene, shot.pose, calibration, shot.light)
        for _ in range(WINDOWS_PER_POSE):
            look = replace(shot, sensor=Sensor.draw(rng), tilt_px=float(rng.normal(0, 0.25)))
            yield _window(rng, renderer, scene, look, calibration)


def _window(
    rng: np.random.Generator,
    renderer: Renderer,
    scene: Scene,
    shot: RandomExposure,
    calibration: Calibration,
) -> Window:
    center_px, range_mm = _interest(rng, renderer, scene, calibration)
    jitter = rng.uniform(-150, 150, 2)
    corner = np.clip(
        center_px + jitter - SIDE_PX / 2,
        0,
        [calibration.width_px - SIDE_PX, calibration.height_px - SIDE_PX],
    )
    x0, y0 = int(corner[0]), int(corner[1])
    offset = round(calibration.disparity_px(range_mm) + rng.normal(0, 6))
    left = renderer.view(0.0, Region(x0, y0, x0 + SIDE_PX, y0 + SIDE_PX))
    right_region = Region(x0 - offset, y0, x0 - offset + SIDE_PX, y0 + SIDE_PX)
    right = renderer.view(calibration.baseline_mm, right_region)
    pictures = expose(shot, left, right, calibration)
    fruitlets = true_fruitlets(renderer, left)
    labels = np.zeros((SIDE_PX, SIDE_PX), np.uint8)
    whole = np.zeros((len(fruitlets), SIDE_PX, SIDE_PX), bool)
    for k, fruitlet in enumerate(fruitlets):
        rows, columns = fruitlet.visible.region.slices
        place = (
            slice(rows.start - y0, rows.stop - y0),
            slice(columns.start - x0, columns.stop - x0),
        )
        labels[place][fruitlet.visible.window] = k + 1
        whole[k][place] = fruitlet.whole.window
    return Window(
        pictures[0], pictures[1], offset, disparity(renderer, left),
        matched(renderer, left, right, 0.0, calibration.baseline_mm), labels, whole,
        np.array([f.diameter_mm for f in fruitlets], np.float32),
    )  # fmt: skip


def _interest(
    rng: np.random.Generator, renderer: Renderer, scene: Scene, calibration: Calibration
) -> tuple[F32, float]:
    """Image place and range of what the window looks at: fruitlets, or the tag."""
    choices = [f.center_mm for f in scene.fruitlets]
    point = scene.tag_center_mm
    if choices and rng.random() < 0.9:
        point = choices[int(rng.integers(len(choices)))]
    seen = renderer.pose.apply(point)
    return np.asarray(calibration.places_px(seen), np.float32), float(seen[2])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument(
        "--count", type=int, default=1000, help="number of scenes, four windows each"
    )
    parser.add_argument("--wild", action="store_true", help="looks that the orchard lacks")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    arguments.out.mkdir(parents=True, exist_ok=True)
    for seed in range(arguments.first, arguments.first + arguments.count):
        last = arguments.out / f"{seed}_{POSES_PER_SCENE * WINDOWS_PER_POSE - 1}.npz"
        if last.exists():
            continue
        for index, window in enumerate(scene_windows(seed, arguments.wild)):
            window.save(arguments.out / f"{seed}_{index}.npz")


if __name__ == "__main__":
    main()
