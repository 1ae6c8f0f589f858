"""How things look in one scene: colours, gloss, leaf shape, dirt.

Colours are linear RGB reflectances. They vary widely on purpose, from woolly
grey-green fruitlets after bloom to red ones, from fresh to dull leaves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcam.simulator.mesh import F32
from fieldcam.values import Floats

_GREENS = np.array([[0.34, 0.42, 0.20], [0.22, 0.33, 0.10], [0.45, 0.50, 0.28], [0.30, 0.36, 0.24]])
_REDS = np.array([[0.42, 0.12, 0.10], [0.50, 0.24, 0.16], [0.30, 0.08, 0.09], [0.48, 0.34, 0.16]])
_LEAVES = np.array([[0.10, 0.20, 0.05], [0.16, 0.28, 0.08], [0.22, 0.34, 0.12], [0.12, 0.18, 0.10]])
_WOOD = np.array([[0.16, 0.12, 0.09], [0.24, 0.20, 0.16], [0.12, 0.10, 0.09], [0.26, 0.19, 0.12]])


@dataclass(frozen=True, slots=True, eq=False)
class Style:
    """The looks that all things of one scene share."""

    skin: F32
    """(3, 3): reflectance at the stem end, the equator and the calyx end."""
    skin_spread: float
    skin_gloss: float
    wool: float
    """0 smooth skin to 1 felt of young fruitlets."""
    leaf: F32
    leaf_width: float
    leaf_teeth: float
    stem: F32
    wood: F32
    sepal: F32
    sepal_spread: float
    paper: F32
    dirt: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Style:
        """Draw one look."""
        green = _mixed(rng, _GREENS)
        blush = _mixed(rng, _REDS)
        redness = float(
            rng.choice([0.0, rng.uniform(0, 0.35), rng.uniform(0.3, 1.0)], p=[0.45, 0.35, 0.2])
        )
        calyx_end = green * (1 - 0.6 * redness) + blush * 0.6 * redness
        equator = green * (1 - redness) + blush * redness
        leaf = _mixed(rng, _LEAVES)
        return cls(
            skin=np.stack([green * rng.uniform(0.8, 1.2), equator, calyx_end]).astype(np.float32),
            skin_spread=rng.uniform(0.02, 0.12),
            skin_gloss=rng.uniform(0.0, 0.5) ** 1.5,
            wool=float(rng.choice([0.0, rng.uniform(0.2, 1.0)], p=[0.6, 0.4])),
            leaf=(leaf * rng.uniform(0.7, 1.8)).astype(np.float32),
            leaf_width=rng.uniform(0.4, 0.68),
            leaf_teeth=rng.uniform(0.0, 0.16),
            stem=(green * 0.6 + leaf * 0.6 + blush * rng.uniform(0, 0.3)).astype(np.float32),
            wood=_mixed(rng, _WOOD),
            sepal=(leaf * rng.uniform(0.6, 1.2) + _mixed(rng, _WOOD) * 0.7).astype(np.float32),
            sepal_spread=rng.uniform(0.1, 1.0),
            paper=np.full(3, rng.uniform(0.55, 0.85), np.float32),
            dirt=rng.uniform(0, 1),
        )


def _mixed(rng: np.random.Generator, palette: Floats) -> F32:
    """A random convex mix of a palette's colours (3,), slightly off in brightness."""
    weights = rng.dirichlet(np.full(len(palette), 0.6))
    return (weights @ palette * rng.uniform(0.75, 1.3)).astype(np.float32)


def varied(rng: np.random.Generator, color: F32, spread: float) -> F32:
    """A colour (3,) near another, in brightness and in hue."""
    shift = rng.normal(0, spread, 3) * 0.5 + rng.normal(0, spread)
    return np.clip(color * np.exp(shift), 0.01, 0.95).astype(np.float32)
