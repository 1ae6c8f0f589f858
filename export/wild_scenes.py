"""Scenes of looks that the simulated orchard's own blocks lack, to train on.

Fruit of the leaves' colour, crowded, up to 20 mm; bloom and hairs; sun beside
the flash; fingers that hold leaves aside; leaves pressed before fruit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcam.simulator import shapes, spur
from fieldcam.simulator.light import SceneLight, Sun
from fieldcam.simulator.mesh import F32, Mesh, MeshPart
from fieldcam.simulator.plan import FIRST_TAG_ID, ClusterPlan, FruitletPlan
from fieldcam.simulator.scene import Scene, build_scene
from fieldcam.simulator.style import varied

FINGER_RADIUS_MM = (6.0, 9.5)
SKIN_TONES = np.array([[0.55, 0.36, 0.27], [0.40, 0.24, 0.16], [0.20, 0.11, 0.07]], np.float32)
GLOVES = np.array([[0.05, 0.06, 0.08], [0.5, 0.5, 0.48], [0.1, 0.25, 0.5], [0.5, 0.3, 0.08]])


def wild_plan(seed: int) -> ClusterPlan:
    """A cluster of three to ten fruitlets of 5 to 20 mm, some crowded."""
    rng = np.random.default_rng([seed, 81])
    mean_mm = float(rng.uniform(6, 18))
    count = int(rng.integers(3, 11 if rng.random() < 0.4 else 7))
    elongation = float(rng.uniform(1.0, 1.18))
    fruitlets = tuple(
        FruitletPlan(
            id=index,
            first_diameter_mm=float(np.clip(mean_mm * rng.lognormal(0, 0.16), 5.0, 20.0)),
            early_rate_mm_per_day=0.0,
            late_rate_mm_per_day=0.0,
            persists=True,
            falls_on_day=float("inf"),
            elongation=float(max(1.0, rng.normal(elongation, 0.03))),
        )
        for index in range(count)
    )
    return ClusterPlan(FIRST_TAG_ID + seed % 500, int(rng.integers(1, 2**31)), fruitlets)


def wild_scene(plan: ClusterPlan, rng: np.random.Generator) -> Scene:
    """The plan's scene, recoloured, with things before the fruit."""
    scene = build_scene(plan, 0.0)
    if rng.random() < 0.6:
        scene = _of_leaf_colour(scene, rng)
    if rng.random() < 0.4:
        scene = _bloomed(scene, rng)
    added: list[Mesh] = []
    for fruitlet in scene.fruitlets:
        if rng.random() < 0.25:
            added.append(_leaf_before(scene, fruitlet.center_mm, fruitlet.diameter_mm, rng))
    if rng.random() < 0.3:
        added += _fingers(rng)
    return replace(scene, meshes=(*scene.meshes, *added))


def wild_light(light: SceneLight, rng: np.random.Generator) -> SceneLight:
    """Daylight: a bright sky, often the sun, and a flash that counts for less."""
    if rng.random() < 0.35:
        return light
    day = float(rng.uniform(0.15, 0.8))
    scale = day / max(float(light.sky.mean()), 1e-3)
    sun = None
    if rng.random() < 0.6:
        aside, ahead = rng.uniform(-3500, 3500), rng.uniform(-2500, 1500)
        place = np.array([aside, -rng.uniform(1500, 4500), ahead], np.float32)
        sun = Sun(place, float(rng.uniform(0.3, 1.3)))
    tint = np.exp(rng.normal(0, 0.1, 3)).astype(np.float32)
    return replace(
        light,
        lamp_strength=light.lamp_strength * float(rng.choice([0.0, 0.3, 0.8])),
        sky=np.full(3, day, np.float32) * tint,
        ground=np.full(3, day * 0.4, np.float32) * tint,
        backdrop=np.clip(light.backdrop * np.float32(min(scale, 60.0)), 0, 3).astype(np.float32),
        sun=sun,
    )


def _recoloured(
    scene: Scene, part: MeshPart, color: F32, spread: float, rng: np.random.Generator
) -> Scene:
    """All things of one kind in a colour, keeping how they vary along themselves."""
    meshes = []
    for mesh in scene.meshes:
        if mesh.part is part:
            tone = mesh.albedo / max(float(mesh.albedo.mean()), 1e-3)
            own = varied(rng, color, spread)
            along = tone.mean(axis=1, keepdims=True)
            mesh = replace(mesh, albedo=np.clip(along * own, 0.01, 0.95).astype(np.float32))
        meshes.append(mesh)
    return replace(scene, meshes=tuple(meshes))


def _of_leaf_colour(scene: Scene, rng: np.random.Generator) -> Scene:
    color = (scene.style.leaf * rng.uniform(0.8, 1.7)).astype(np.float32)
    return _recoloured(scene, MeshPart.FRUIT, color, float(rng.uniform(0.03, 0.12)), rng)


def _bloomed(scene: Scene, rng: np.random.Generator) -> Scene:
    """A grey bloom over the skin, and felt."""
    share, grey = np.float32(rng.uniform(0.15, 0.6)), np.float32(rng.uniform(0.3, 0.6))
    meshes = tuple(
        replace(m, albedo=(m.albedo * (1 - share) + grey * share).astype(np.float32), gloss=0.0)
        if m.part is MeshPart.FRUIT
        else m
        for m in scene.meshes
    )
    style = replace(scene.style, wool=float(rng.uniform(0.5, 1.5)))
    return replace(scene, meshes=meshes, style=style)


def _leaf_before(
    scene: Scene, center_mm: F32, diameter_mm: float, rng: np.random.Generator
) -> Mesh:
    """A leaf whose blade passes close before a fruitlet, on one side of it."""
    side = rng.uniform(0, 2 * np.pi)
    across = np.array([np.cos(side), np.sin(side), 0.0])
    along = np.array([-np.sin(side), np.cos(side), rng.normal(0, 0.3)])
    along /= np.linalg.norm(along)
    away = diameter_mm * rng.uniform(0.35, 1.3)
    foot = center_mm + across * away - along * rng.uniform(15, 30)
    foot[2] -= diameter_mm / 2 + rng.uniform(1, 8)
    facing = np.cross(along, across)
    color = spur.rgb(varied(rng, scene.style.leaf, 0.2))
    length = float(rng.uniform(30, 70))
    leaf = shapes.leaf(length, length * scene.style.leaf_width, 0.3, 0.2, 0.1, color)
    turn = np.stack([along, across, facing], axis=1).astype(np.float32)
    return leaf.moved(turn, foot.astype(np.float32))


def _fingers(rng: np.random.Generator) -> list[Mesh]:
    """Two to four fingers that reach in from one side, bare or gloved."""
    tones = SKIN_TONES if rng.random() < 0.7 else GLOVES.astype(np.float32)
    tone = tones[int(rng.integers(len(tones)))] * np.float32(rng.uniform(0.8, 1.2))
    side = rng.uniform(0, 2 * np.pi)
    inward = -np.array([np.cos(side), np.sin(side), 0.0])
    beside = np.array([-inward[1], inward[0], 0.0])
    radius = float(rng.uniform(*FINGER_RADIUS_MM))
    tip = -inward * rng.uniform(18, 45)
    tip[2] = rng.uniform(-35, 5)
    fingers = []
    for index in range(int(rng.integers(2, 5))):
        end = tip + beside * (index * 2.1 * radius) + inward * rng.normal(0, 6)
        start = end - inward * 110 + np.array([0, 0, -rng.uniform(10, 60)])
        path = shapes.arc(start.astype(np.float32), end.astype(np.float32), rng.uniform(-8, 8), 20)
        left = np.linspace(110, 0, 20)
        shape = radius * np.sqrt(np.clip(1 - np.clip(1 - left / radius, 0, 1) ** 2, 0.02, 1))
        fingers.append(shapes.tube(path, shape, spur.rgb(tone), MeshPart.STEM, 20))
    return fingers
