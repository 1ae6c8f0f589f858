"""Pictures of simulated clusters, rendered only where the analysis looks.

The part around the tag is what `capture` would give but for the sensor's noise, at less
than half the time; beyond it the pictures are grey.
"""

from __future__ import annotations

import numpy as np

from fieldcam.simulator import BlockPlan, Faults, Truth
from fieldcam.simulator.capture import Aim, aim, expose
from fieldcam.simulator.render import EyeView
from fieldcam.simulator.truth import disparity, true_fruitlets
from fieldcam.values import ImageU8, Region, StereoPair
from fieldcam.vision.regions import REGION_MM

MARGIN_PX = 64
"""The tag is found a little beside its true place, and the right eye looks a little wider."""
GREY = 70


def photograph(
    block: BlockPlan, cluster_index: int, day: float, view: int
) -> tuple[StereoPair, Truth]:
    """A rectified pair and the truth about its fruitlets; where both eyes see is not worked out."""
    aimed = aim(block, cluster_index, day, view, Faults())
    regions = _regions(aimed)
    eyes = (0.0, aimed.calibration.baseline_mm)
    left, right = (aimed.renderer.view(x, r) for x, r in zip(eyes, regions, strict=True))
    pictures = expose(aimed.shot, left, right, aimed.calibration)
    pair = StereoPair(_framed(pictures[0], left, aimed), _framed(pictures[1], right, aimed))
    return pair, _truth(aimed, left)


def _regions(aimed: Aim) -> tuple[Region, Region]:
    """What is rendered for the left eye and for the right one."""
    c, scene = aimed.calibration, aimed.renderer.scene
    tag_mm = aimed.shot.pose.apply(scene.tag_center_mm)
    half = REGION_MM / 2 * c.px_per_mm(float(tag_mm[2])) + MARGIN_PX
    column, row = c.places_px(tag_mm)
    shift = c.disparity_px(float(tag_mm[2]))

    def around(center: float) -> Region:
        x0, x1 = (int(np.clip(center + s * half, 0, c.width_px)) for s in (-1, 1))
        y0, y1 = (int(np.clip(row + s * half, 0, c.height_px)) for s in (-1, 1))
        return Region(x0, y0, x1, y1)

    return around(column), around(column - shift)


def _framed(picture: ImageU8, view: EyeView, aimed: Aim) -> ImageU8:
    whole = np.full((aimed.calibration.height_px, aimed.calibration.width_px, 3), GREY, np.uint8)
    whole[view.region.slices] = picture
    return whole


def _truth(aimed: Aim, left: EyeView) -> Truth:
    scene, pose = aimed.renderer.scene, aimed.shot.pose
    x, y, z = (float(v) for v in pose.apply(scene.tag_center_mm))
    unknown = np.zeros((0, 0), np.bool_)
    return Truth(
        tag_id=scene.tag_id,
        tag_center_mm=(x, y, z),
        tag_rotation=(pose.rotation @ scene.tag_rotation).astype(np.float32),
        fruitlets=true_fruitlets(aimed.renderer, left),
        left_disparity_px=disparity(aimed.renderer, left),
        left_matched=unknown,
    )
