"""A whole scene: the tagged cluster, its tag, its neighbours and what is around.

Frame: origin at the tagged cluster's spur, x right, y down (gravity), z away
from the operator, millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from fieldcam.simulator import shapes, spur
from fieldcam.simulator.mesh import F32, Mesh, MeshPart
from fieldcam.simulator.plan import ClusterPlan
from fieldcam.simulator.spur import TrueSize
from fieldcam.simulator.style import Style, varied
from fieldcam.values import TAG_SIZE_MM

CARD_MM = TAG_SIZE_MM * 1.36
NEIGHBOUR_ID = -1


@dataclass(frozen=True, slots=True, eq=False)
class SceneFruitlet:
    """The truth about one fruitlet of a scene."""

    id: int
    """Identity over days in its cluster; NEIGHBOUR_ID outside the tagged one."""
    diameter_mm: float
    center_mm: F32

    @property
    def in_target(self) -> bool:
        return self.id != NEIGHBOUR_ID


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Everything that the renderer draws, and the truth about it."""

    meshes: tuple[Mesh, ...]
    fruitlets: tuple[SceneFruitlet, ...]
    """A mesh's `fruitlet` is an index into this."""
    tag_id: int
    tag_center_mm: F32
    tag_rotation: F32
    style: Style


@dataclass(frozen=True, slots=True)
class Motion:
    """How far things move between two visits (standard deviations)."""

    turn_rad: float = 0.31
    """Of the whole spur, about a random axis."""
    shift_mm: float = 6.0
    stem_rad: float = 0.11
    """Of each stem by itself."""
    sag: float = 0.2
    tag_swing_rad: float = 0.3
    tag_shift_mm: float = 8.0


def build_scene(plan: ClusterPlan, day: float, motion: Motion | None = None) -> Scene:
    """The scene of one tagged cluster on one day."""
    fixed = np.random.default_rng([plan.seed, 2])
    moving = np.random.default_rng([plan.seed, 3, round(day * 24)])
    style = Style.draw(fixed)
    motion = motion or Motion()
    target, fruitlets = _target(fixed, moving, plan, day, style, motion)
    meshes = list(target)
    home = _tag_home(plan)
    tag_meshes, center, rotation = _tag(home, fixed, moving, style, motion, fruitlets)
    for _ in range(int(fixed.choice([0, 1, 2, 3, 4], p=[0.1, 0.25, 0.3, 0.2, 0.15]))):
        added, known = _neighbour(fixed, style, len(fruitlets), home)
        meshes += added
        fruitlets += known
    meshes += _clutter(fixed, style)
    return Scene(tuple(meshes + tag_meshes), tuple(fruitlets), plan.tag_id, center, rotation, style)


def with_covered_tag(scene: Scene, share: float) -> Scene:
    """The same scene with a leaf across the tag that hides its upper share from the operator."""
    length_mm, width_mm = 3.0 * TAG_SIZE_MM, 1.5 * TAG_SIZE_MM
    leaf = shapes.leaf(length_mm, width_mm, 0.15, 0.1, 0.0, spur.rgb(scene.style.leaf))
    lower_edge_mm = (share - 0.5) * TAG_SIZE_MM
    foot_mm = np.array([-length_mm / 2, lower_edge_mm - 0.45 * width_mm, -6.0], np.float32)
    # The operator looks along the tag's z axis, and the leaf bends along its own -z.
    facing = np.diag([1.0, -1.0, -1.0]).astype(np.float32)
    on_tag = leaf.moved(facing, foot_mm)
    covering = on_tag.moved(scene.tag_rotation, scene.tag_center_mm)
    return replace(scene, meshes=(*scene.meshes, covering))


def _target(
    fixed: np.random.Generator, moving: np.random.Generator, plan: ClusterPlan,
    day: float, style: Style, motion: Motion,
) -> tuple[list[Mesh], list[SceneFruitlet]]:  # fmt: skip
    along = spur.heading(fixed)
    count = len(plan.fruitlets)
    directions = spur.stem_directions(fixed, count, along)
    stems = fixed.uniform(11, 25, count) + 1.2 * min(day, 8.0)
    skins = [varied(fixed, style.skin, style.skin_spread) for _ in range(count)]
    detail_seeds = fixed.integers(1, 2**31, count)
    leaves = spur.leaf_meshes(fixed, style, along, int(fixed.integers(3, 9)))
    directions += moving.normal(0, motion.stem_rad, directions.shape).astype(np.float32)
    sag = fixed.uniform(0.0, 0.5) + abs(moving.normal(0, motion.sag))
    alive = [i for i, f in enumerate(plan.fruitlets) if f.hangs(day)]
    sizes = [
        TrueSize(plan.fruitlets[i].diameter_mm(day), plan.fruitlets[i].elongation) for i in alive
    ]
    turn = _small_rotation(moving, motion.turn_rad)
    shift = moving.normal(0, motion.shift_mm, 3).astype(np.float32)
    placed = spur.hang(moving, sizes, directions[alive], stems[alive], sag) if alive else []
    meshes = list(leaves)
    known = []
    for index, (i, hung) in enumerate(zip(alive, placed, strict=True)):
        detail = np.random.default_rng(detail_seeds[i])
        meshes += spur.fruitlet_meshes(detail, hung, style, index, skins[i], 64)
        center = turn @ hung.center_mm + shift
        known.append(SceneFruitlet(i, hung.size.diameter_mm, center))
    return [m.moved(turn, shift) for m in meshes], known


def _neighbour(
    rng: np.random.Generator, style: Style, first_index: int, tag_mm: F32
) -> tuple[list[Mesh], list[SceneFruitlet]]:
    """Another cluster of the same tree, 60 to 250 mm away."""
    along = spur.heading(rng)
    sizes = [
        TrueSize(float(rng.uniform(5, 19)), float(rng.uniform(1.02, 1.15)))
        for _ in range(int(rng.integers(1, 7)))
    ]
    directions = spur.stem_directions(rng, len(sizes), along)
    placed = spur.hang(rng, sizes, directions, rng.uniform(10, 22, len(sizes)), rng.uniform(0, 0.6))
    offset = _neighbour_offset(rng, tag_mm)
    meshes = spur.leaf_meshes(rng, style, along, int(rng.integers(2, 8)))
    known = []
    for i, hung in enumerate(placed):
        skin = varied(rng, style.skin, style.skin_spread * 1.3)
        meshes += spur.fruitlet_meshes(rng, hung, style, first_index + i, skin, 48)
        known.append(SceneFruitlet(NEIGHBOUR_ID, hung.size.diameter_mm, hung.center_mm + offset))
    still = np.eye(3, dtype=np.float32)
    return [m.moved(still, offset) for m in meshes], known


def _neighbour_offset(rng: np.random.Generator, tag_mm: F32) -> F32:
    """Where a neighbour's spur is; a tag is hung where no other cluster could be meant."""
    for _ in range(30):
        angle, away = rng.uniform(0, 2 * np.pi), rng.uniform(75, 230)
        depth = float(np.clip(rng.normal(25, 50), -70, 160))
        offset = np.array([away * np.cos(angle), away * np.sin(angle) * 0.8, depth], np.float32)
        if np.linalg.norm(offset - tag_mm) > np.linalg.norm(tag_mm) + 30:
            break
    return offset


def _tag_home(plan: ClusterPlan) -> F32:
    """Where the tag hangs when no wind moves it, before it is pushed clear of fruitlets."""
    rng = np.random.default_rng([plan.seed, 6])
    angle, away = rng.uniform(-0.6, np.pi + 0.6), rng.uniform(36, 62)
    return np.array([away * np.cos(angle), away * np.sin(angle), rng.uniform(-32, 6)], np.float32)


def _clutter(rng: np.random.Generator, style: Style) -> list[Mesh]:
    """The twig that carries the spur, leaves near and far, branches and maybe the trunk."""
    wood = spur.rgb(style.wood)
    back = np.array([rng.normal(0, 60), rng.normal(0, 40), rng.uniform(20, 70)], np.float32)
    meshes = [_limb(np.zeros(3, np.float32), back, 2.2, 4.0, wood)]
    slope = np.array([1.0, rng.normal(0, 0.5), rng.normal(0, 0.3)], np.float32) * 400
    meshes.append(_limb(back - slope, back + slope, rng.uniform(4, 9), rng.uniform(4, 9), wood))
    for _ in range(int(rng.integers(20, 130))):
        foot = np.array([rng.normal(0, 140), rng.normal(0, 110), rng.uniform(15, 240)], np.float32)
        meshes.append(spur.blade(rng, style, foot, _direction(rng), rng.uniform(0.8, 1.4)))
    for _ in range(int(rng.choice([0, 40, 160]))):
        foot = np.array([*rng.normal(0, 260, 2), rng.uniform(240, 800)], np.float32)
        meshes.append(spur.blade(rng, style, foot, _direction(rng), rng.uniform(0.8, 2.0)))
    for _ in range(int(rng.integers(0, 4))):
        foot = np.array([rng.normal(0, 60), rng.normal(0, 60), rng.uniform(-70, -25)], np.float32)
        if np.hypot(foot[0], foot[1]) > 45:
            meshes.append(spur.blade(rng, style, foot, _direction(rng), 0.8))
    for _ in range(int(rng.integers(0, 4))):
        middle = np.array([rng.normal(0, 120), rng.normal(0, 90), rng.uniform(60, 300)], np.float32)
        reach = _direction(rng) * 250
        meshes.append(_limb(middle - reach, middle + reach, 2.0, rng.uniform(2, 6), wood))
    if rng.random() < 0.35:
        middle = np.array([rng.normal(0, 150), 0, rng.uniform(180, 400)], np.float32)
        reach = np.array([rng.normal(0, 60), 600, rng.normal(0, 40)], np.float32)
        meshes.append(_limb(middle - reach, middle + reach, 30, 45, wood, 48))
    return meshes


def _limb(
    start: F32, end: F32, start_radius: float, end_radius: float, color: shapes.Rgb, sides: int = 14
) -> Mesh:
    path = shapes.arc(start, end, 6.0, 16)
    radius = np.linspace(start_radius, end_radius, len(path))
    return shapes.tube(path, radius, color, MeshPart.BARK, sides)


def _tag(
    home_mm: F32,
    fixed: np.random.Generator,
    moving: np.random.Generator,
    style: Style,
    motion: Motion,
    beside: list[SceneFruitlet],
) -> tuple[list[Mesh], F32, F32]:
    """The printed tag on a card that hangs on a string beside the cluster."""
    center = (home_mm + moving.normal(0, 1, 3) * motion.tag_shift_mm * [1, 0.5, 0.6]).astype(
        np.float32
    )
    center = _clear_of(center, beside)
    swing = moving.normal(0, 1, 3) * motion.tag_swing_rad
    tilt = np.clip(fixed.normal(0, 0.22, 3) + swing * [0.6, 1.0, 0.7], -0.7, 0.7)
    rotation = (
        Rotation.from_euler("yxz", [tilt[1], tilt[0], tilt[2]]).as_matrix().astype(np.float32)
    )
    card = shapes.tag_card(CARD_MM, spur.rgb(style.paper)).moved(rotation, center)
    top = center + rotation @ np.array([0, -CARD_MM / 2 + 1, 0], np.float32)
    knot = top + np.array([fixed.normal(0, 6), -fixed.uniform(30, 60), 25], np.float32)
    string = shapes.tube(
        shapes.arc(top.astype(np.float32), knot.astype(np.float32), 0.0), np.full(12, 0.5),
        spur.rgb(style.paper), MeshPart.STRING, 5,
    )  # fmt: skip
    return [card, string], center, rotation


def _clear_of(center_mm: F32, fruitlets: list[SceneFruitlet]) -> F32:
    """Pushed away from the spur until no fruitlet hangs in front of the card."""
    outward = center_mm[:2] / np.linalg.norm(center_mm[:2])
    moved = center_mm.copy()
    for _ in range(30):
        gaps = [
            np.abs(moved[:2] - f.center_mm[:2]).max() - f.diameter_mm / 2 - CARD_MM / 2
            for f in fruitlets
        ]
        if not gaps or min(gaps) > 2.0:
            break
        moved[:2] += 3.0 * outward
    return moved


def _direction(rng: np.random.Generator) -> F32:
    vector = rng.normal(size=3)
    return (vector / np.linalg.norm(vector)).astype(np.float32)


def _small_rotation(rng: np.random.Generator, angle_rad: float) -> F32:
    vector = rng.normal(0, angle_rad / np.sqrt(3), 3)
    return Rotation.from_rotvec(vector).as_matrix().astype(np.float32)
