"""Looks that the orchard lacks: seeded, crowded, of the leaves' colour, in the sun."""

from __future__ import annotations

import numpy as np
import pytest

from export import wild_scenes
from export.render_windows import scene_windows
from fieldcam.simulator.light import SceneLight
from fieldcam.simulator.mesh import MeshPart

pytestmark = pytest.mark.export


def test_equal_seeds_give_equal_scenes() -> None:
    one, other = (
        wild_scenes.wild_scene(wild_scenes.wild_plan(7), np.random.default_rng(3)) for _ in range(2)
    )
    assert len(one.meshes) == len(other.meshes)
    assert all(
        np.array_equal(a.albedo, b.albedo) for a, b in zip(one.meshes, other.meshes, strict=True)
    )


def test_fruit_is_up_to_20_mm_and_crowded() -> None:
    plans = [wild_scenes.wild_plan(seed) for seed in range(60)]
    sizes = [f.first_diameter_mm for plan in plans for f in plan.fruitlets]
    assert 5 <= min(sizes) < 7
    assert 19 < max(sizes) <= 20
    assert max(len(plan.fruitlets) for plan in plans) == 10


def test_some_fruit_has_the_colour_of_its_leaves() -> None:
    gaps = []
    for seed in range(12):
        scene = wild_scenes.wild_scene(wild_scenes.wild_plan(seed), np.random.default_rng(seed))
        tones = {
            part: np.mean([m.albedo.mean(axis=0) for m in scene.meshes if m.part is part], axis=0)
            for part in (MeshPart.FRUIT, MeshPart.LEAF)
        }
        fruit, leaf = (tone / tone.sum() for tone in tones.values())
        gaps.append(np.abs(fruit - leaf).max())
    assert min(gaps) < 0.03
    assert max(gaps) > 0.1


def test_the_sun_lights_what_the_lamps_do_not_reach() -> None:
    rng = np.random.default_rng(0)
    lights = [wild_scenes.wild_light(SceneLight.draw(rng, 60.0), rng) for _ in range(30)]
    assert any(light.sun is None for light in lights)
    assert any(light.sun is not None and light.lamp_strength == 0 for light in lights)


def test_a_wild_window_has_its_truth() -> None:
    window = next(scene_windows(500_003, wild=True))
    assert window.left.shape == window.right.shape == (448, 448, 3)
    assert len(window.whole) == len(window.diameter_mm)
    assert set(np.unique(window.labels)) <= set(range(len(window.whole) + 1))
