"""Pairs of looks that no network was trained on, to see whether the verdict notices.

`python -m export.strange_looks [--clusters N]` renders each look of `LOOKS`, runs the
shipped networks as `fieldcam size` does, and prints how many of the well-visible
target fruitlets were found in each and what the verdict said. Fruit and light here
are made to be unlike the simulated orchard, the training windows and each other.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from export.evaluate import Outcome, measure
from export.render_orchard import Order, write
from fieldcam.report.scoring import WELL_VISIBLE
from fieldcam.simulator import BlockPlan, Faults, SimulatedCapture, shapes
from fieldcam.simulator.capture import (
    Aim,
    RandomExposure,
    both_eyes,
    calibration_of,
    develop,
    draw_shot,
    parted,
)
from fieldcam.simulator.mesh import F32, Mesh, MeshPart
from fieldcam.simulator.plan import ClusterPlan
from fieldcam.simulator.render import Renderer
from fieldcam.simulator.scene import Scene, build_scene

CACHE = Path("export/.cache/strange")
SEED = 8_500_001
FEW = 0.5
"""Share of the well-visible target fruitlets below which an ACCEPT is wrong."""

Change = Callable[[Scene, RandomExposure, np.random.Generator], tuple[Scene, RandomExposure]]


def _painted(scene: Scene, part: MeshPart, paint: Callable[[Mesh], F32]) -> Scene:
    meshes = tuple(
        replace(m, albedo=np.clip(paint(m), 0.01, 0.95).astype(np.float32)) if m.part is part else m
        for m in scene.meshes
    )
    return replace(scene, meshes=meshes)


def _striped(
    scene: Scene, shot: RandomExposure, rng: np.random.Generator
) -> tuple[Scene, RandomExposure]:
    """Fruit with dark rings, as a melon has."""
    period = rng.uniform(1.5, 4.0)
    rings = lambda m: m.albedo * (0.3 + 0.7 * (np.sin(m.local[:, 2:] * 2 * np.pi / period) > 0))  # noqa: E731
    return _painted(scene, MeshPart.FRUIT, rings), shot


def _blue(
    scene: Scene, shot: RandomExposure, rng: np.random.Generator
) -> tuple[Scene, RandomExposure]:
    """Fruit of a colour that no apple has."""
    color = np.array([[0.05, 0.1, 0.6], [0.5, 0.05, 0.5], [0.02, 0.02, 0.03]])[rng.integers(3)]
    return _painted(scene, MeshPart.FRUIT, lambda m: np.tile(color, (len(m.albedo), 1))), shot


def _kaolin(
    scene: Scene, shot: RandomExposure, rng: np.random.Generator
) -> tuple[Scene, RandomExposure]:
    """Everything under the white film of a particle spray."""
    share = rng.uniform(0.7, 0.95)
    for part in (MeshPart.FRUIT, MeshPart.LEAF, MeshPart.STEM, MeshPart.SEPAL, MeshPart.BARK):
        scene = _painted(scene, part, lambda m: m.albedo * (1 - share) + 0.85 * share)
    return scene, shot


def _netted(
    scene: Scene, shot: RandomExposure, rng: np.random.Generator
) -> tuple[Scene, RandomExposure]:
    """A hail net between the camera and the tree."""
    step, z = rng.uniform(6, 9), -75.0
    color = (0.7, 0.7, 0.7) if rng.random() < 0.5 else (0.03, 0.03, 0.03)
    threads = []
    for at in np.arange(-110, 110, step):
        for ends in ([[at, -110, z], [at, 110, z]], [[-110, at, z], [110, at, z]]):
            start, end = np.array(ends, np.float32)
            path = shapes.arc(start, end, 0.0, 4)
            threads.append(shapes.tube(path, np.full(4, 0.35), color, MeshPart.STRING, 5))
    return replace(scene, meshes=(*scene.meshes, *threads)), shot


def _wet(
    scene: Scene, shot: RandomExposure, rng: np.random.Generator
) -> tuple[Scene, RandomExposure]:
    """Fruit and leaves that mirror the lamps."""
    shiny = tuple(
        replace(m, gloss=float(rng.uniform(2, 4)))
        if m.part in (MeshPart.FRUIT, MeshPart.LEAF)
        else m
        for m in scene.meshes
    )
    return replace(scene, meshes=shiny), shot


def _long(
    scene: Scene, shot: RandomExposure, rng: np.random.Generator
) -> tuple[Scene, RandomExposure]:
    """Fruit as long as a date."""
    stretch = float(rng.uniform(1.7, 2.2))
    meshes = []
    for mesh in scene.meshes:
        if mesh.part is MeshPart.FRUIT:
            middle = scene.fruitlets[mesh.fruitlet].center_mm
            tall = (mesh.vertices_mm - middle) * np.array([1, stretch, 1]) + middle
            mesh = replace(mesh, vertices_mm=tall.astype(np.float32))
        meshes.append(mesh)
    return replace(scene, meshes=tuple(meshes)), shot


def _lamp(
    scene: Scene, shot: RandomExposure, rng: np.random.Generator
) -> tuple[Scene, RandomExposure]:
    """Light of one colour, as under a red or a yellow work lamp."""
    tones = np.array([[1.0, 0.08, 0.05], [1.0, 0.7, 0.05], [0.1, 0.15, 1.0]], np.float32)
    tone = tones[rng.integers(3)]
    light = replace(shot.light, lamp_color=tone, sky=shot.light.sky * tone)
    return scene, replace(shot, light=light)


def _swapped(
    scene: Scene, shot: RandomExposure, rng: np.random.Generator
) -> tuple[Scene, RandomExposure]:
    """Pale leaves and dark fruit, as a camera for near infrared sees them."""
    leaf, fruit = rng.uniform(0.6, 0.8), rng.uniform(0.1, 0.2)
    scene = _painted(scene, MeshPart.LEAF, lambda m: np.full_like(m.albedo, leaf))
    return _painted(scene, MeshPart.FRUIT, lambda m: np.full_like(m.albedo, fruit)), shot


LOOKS: dict[str, Change] = {
    "striped": _striped, "blue": _blue, "kaolin": _kaolin, "net": _netted, "wet": _wet,
    "long": _long, "lamp": _lamp, "infrared": _swapped,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class StrangeOrder(Order):
    """A capture of one cluster in one strange look."""

    look: str = "striped"

    @property
    def name(self) -> str:
        return f"{self.look}_{self.seed}"

    def render(self) -> SimulatedCapture:
        return develop(both_eyes(self._aim(), 0, self.day, 0), Faults())

    def _aim(self) -> Aim:
        block = BlockPlan.plan(self.seed, 1)
        plan: ClusterPlan = block.clusters[0]
        calibration = calibration_of(block)
        scene = build_scene(plan, self.day)
        shot = draw_shot(plan, scene, self.day, 0, calibration, Faults())
        scene = parted(scene, shot, calibration)
        rng = np.random.default_rng([self.seed, 91])
        scene, shot = LOOKS[self.look](scene, shot, rng)
        return Aim(plan, calibration, shot, Renderer(scene, shot.pose, calibration, shot.light))


def orders(clusters: int) -> Iterator[StrangeOrder]:
    """Each look with clusters of its own."""
    for number in range(clusters):
        for index, name in enumerate(LOOKS):
            seed = SEED + number * len(LOOKS) + index
            yield StrangeOrder(seed, 1, 0, float(number % 3) * 2.0, look=name)


def found_share(outcome: Outcome) -> float | None:
    """Share of the well-visible target fruitlets that were found; None where there are none."""
    well = [
        k
        for k, f in enumerate(outcome.truth["fruitlets"])
        if f["in_target"] and f["visible_fraction"] >= WELL_VISIBLE
    ]
    return sum(k in outcome.partners for k in well) / len(well) if well else None


def table(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Markdown; the last row is all looks together."""
    yield "| look | pairs | well visible found | ACCEPT | CONFIRM | RETAKE | ACCEPT over few |"
    yield "| --- |" + " ---: |" * 6
    for name in LOOKS:
        yield _row(name, [o for o in outcomes if o.name.startswith(f"{name}_")])
    yield _row("all", outcomes)


def accepted_over_few(outcome: Outcome) -> bool:
    """Whether the verdict let pass what found less than half of what can be seen."""
    share = found_share(outcome)
    return outcome.report["verdict"]["status"] == "accept" and share is not None and share < FEW


def _row(name: str, outcomes: Sequence[Outcome]) -> str:
    shares = [s for o in outcomes if (s := found_share(o)) is not None]
    said = [o.report["verdict"]["status"] for o in outcomes]
    counts = " | ".join(str(said.count(status)) for status in ("accept", "confirm", "retake"))
    wrong = sum(accepted_over_few(o) for o in outcomes)
    mean = f"{np.mean(shares):.0%}" if shares else "-"
    return f"| {name} | {len(outcomes)} | {mean} | {counts} | {wrong} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--clusters", type=int, default=6)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    for order in orders(arguments.clusters):
        write(order, CACHE / order.name)
    sys.stdout.write("\n".join(table(measure(CACHE, []))) + "\n")


if __name__ == "__main__":
    main()
