"""What stands between the camera and the printed tag."""

from __future__ import annotations

import numpy as np

from fieldcam.simulator.mesh import F32, Mesh, MeshPart, join
from fieldcam.simulator.raycast import RayCaster
from fieldcam.simulator.render import EyePose
from fieldcam.simulator.scene import CARD_MM, Scene
from fieldcam.values import TAG_SIZE_MM

_SAMPLES = 12
"""Points to a side of the print that are looked for from each eye."""
_ON_CARD = 0.9995
"""Share of the way to the card beyond which a hit is the card's own surface."""


HIDING = (MeshPart.LEAF, MeshPart.STEM, MeshPart.BARK)
"""What a free hand parts, and the wood behind which nobody hangs a tag."""


def hiding_the_tag(scene: Scene, pose: EyePose, eyes_x_mm: tuple[float, ...]) -> set[int]:
    """Indices of the leaves, stems and wood that hide a part of the tag from an eye."""
    points = pose.apply(_print_mm(scene))
    moved = {
        index: mesh.moved(pose.rotation, pose.translation_mm)
        for index, mesh in enumerate(scene.meshes)
        if mesh.part in HIDING
    }
    hiding: set[int] = set()
    for eye_x_mm in eyes_x_mm:
        eye = np.array([eye_x_mm, 0, 0], np.float32)
        near = [k for k, mesh in moved.items() if _may_hide(mesh, eye, points.mean(axis=0))]
        if near:
            soup = join([moved[k] for k in near])
            hits = RayCaster(soup).first_hits(eye, points - eye)
            first = hits.triangle[hits.found & (hits.distance < _ON_CARD)]
            hiding |= {near[thing] for thing in soup.thing[first].tolist()}
    return hiding


def _print_mm(scene: Scene) -> F32:
    """Points (N, 3) all over the print, in the scene's frame."""
    side = np.linspace(-0.55, 0.55, _SAMPLES, dtype=np.float32) * np.float32(TAG_SIZE_MM)
    x, y = np.meshgrid(side, side)
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(x.size, np.float32)], axis=1)
    return np.asarray(flat @ scene.tag_rotation.T + scene.tag_center_mm, np.float32)


def _may_hide(mesh: Mesh, eye: F32, tag_mm: F32) -> bool:
    """Whether the mesh's bounding ball reaches into the line from an eye to the card."""
    middle = (mesh.vertices_mm.min(axis=0) + mesh.vertices_mm.max(axis=0)) / 2
    reach_mm = float(np.linalg.norm(mesh.vertices_mm - middle, axis=1).max())
    line, offset = tag_mm - eye, middle - eye
    along = float(np.clip(offset @ line / (line @ line), 0, 1))
    return float(np.linalg.norm(offset - along * line)) < reach_mm + CARD_MM
