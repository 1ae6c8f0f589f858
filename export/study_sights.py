"""How much of a fallen fruitlet the study's pictures would show if it still hung there.

A picture that would not show it cannot tell that it fell. Fallen fruitlets are put back where
the simulator would have hung them that day, and rays are cast from their fronts to the camera.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Mapping
from dataclasses import replace
from math import inf

import numpy as np

from export.study_captures import VIEWS, Job, write_document
from fieldcam.growth.fate import disk_points
from fieldcam.simulator import Faults
from fieldcam.simulator.capture import aim
from fieldcam.simulator.mesh import F32
from fieldcam.simulator.scene import build_scene

POINTS = 200


def sights(job: Job) -> Mapping[int, float]:
    """Visible fraction of each fruitlet that has fallen by then, kept beside the capture."""
    path = job.path.with_name(f"sights_{job.path.name}")
    if not path.exists():
        attempts = json.loads(gzip.decompress(job.path.read_bytes()))["attempts"]
        write_document(path, _looked_for(job, job.view + VIEWS * (attempts - 1)))
    document = json.loads(gzip.decompress(path.read_bytes()))
    return {int(id_): share for id_, share in document.items()}


def _looked_for(job: Job, view: int) -> dict[str, float]:
    block = job.of.block()
    plan = block.clusters[job.cluster]
    fallen = [f.id for f in plan.fruitlets if not f.hangs(job.day)]
    if not fallen:
        return {}
    renderer = aim(block, job.cluster, job.day, view, Faults()).renderer
    whole = replace(plan, fruitlets=tuple(replace(f, falls_on_day=inf) for f in plan.fruitlets))
    found = {}
    for fruitlet in build_scene(whole, job.day).fruitlets:
        if fruitlet.id in fallen:
            center = renderer.pose.apply(fruitlet.center_mm)
            front = _front(center, fruitlet.diameter_mm / 2)
            found[str(fruitlet.id)] = round(float(renderer.seen_from(front, 0.0).mean()), 3)
    return found


def _front(center_mm: F32, radius_mm: float) -> F32:
    """Points (POINTS, 3) of its surface that stand evenly in its image."""
    disk = disk_points(POINTS)
    toward = -center_mm / np.linalg.norm(center_mm)
    across = np.cross(toward, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    up = np.cross(across, toward)
    height = np.sqrt(1 - (disk**2).sum(axis=1))
    points = disk @ np.stack([across, up]) + np.outer(height, toward)
    return np.asarray(center_mm + radius_mm * points, np.float32)
