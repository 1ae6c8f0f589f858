"""Surface patterns, looked up by coordinates that are fixed to each thing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fieldcam.simulator.mesh import F32, MeshPart
from fieldcam.simulator.style import Style
from fieldcam.values import TAG_SIZE_MM
from fieldcam.vision.tags.pattern import tag_cells

_TILE = 64
_LATTICE = np.random.default_rng(36).random((_TILE, _TILE, _TILE), dtype=np.float32) * 2 - 1
_CELL_PX = 16


def noise(points: F32, period: float) -> F32:
    """Smooth noise in -1 to 1 at points (N, 3), one lattice cell per `period`."""
    scaled = points / period
    low = np.floor(scaled)
    t = (scaled - low).astype(np.float32)
    t = t * t * (3 - 2 * t)
    i = low.astype(np.int32) & (_TILE - 1)
    j = (i + 1) & (_TILE - 1)
    flat = _LATTICE.reshape(-1)
    out = np.zeros(len(points), np.float32)
    for corner in range(8):
        x = j[:, 0] if corner & 1 else i[:, 0]
        y = j[:, 1] if corner & 2 else i[:, 1]
        z = j[:, 2] if corner & 4 else i[:, 2]
        weight = (
            (t[:, 0] if corner & 1 else 1 - t[:, 0])
            * (t[:, 1] if corner & 2 else 1 - t[:, 1])
            * (t[:, 2] if corner & 4 else 1 - t[:, 2])
        )
        out += weight * flat[(x * _TILE + y) * _TILE + z]
    return out


def grain(points: F32, period: float) -> F32:
    """Blocky noise in -1 to 1 at points (N, 3): cheap, for fine detail."""
    i = np.floor(points / period).astype(np.int32) & (_TILE - 1)
    return np.asarray(_LATTICE.reshape(-1)[(i[:, 0] * _TILE + i[:, 1]) * _TILE + i[:, 2]])


def tag_image(tag_id: int) -> F32:
    """The tag's print (H, H) at _CELL_PX pixels a bit, 1 white and 0 black."""
    white = np.pad(tag_cells(tag_id), 1, constant_values=255)
    printed = np.kron(white, np.ones((_CELL_PX, _CELL_PX), np.uint8))
    return np.asarray(printed / 255, np.float32)


def reflectance(
    albedo: F32, local: F32, part: npt.NDArray[np.uint8], thing: npt.NDArray[np.int32],
    style: Style, tag_print: F32,
) -> F32:  # fmt: skip
    """Patterned reflectance (N, 3) from the plain one of each hit's thing."""
    shifted = local + (thing % 97)[:, None].astype(np.float32) * np.float32(7.31)
    out = albedo * (1 + 0.10 * noise(shifted, 2.3))[:, None]
    out *= (1 + 0.05 * grain(shifted, 0.23))[:, None]
    for kind, paint in ((MeshPart.FRUIT, _skin), (MeshPart.LEAF, _veins), (MeshPart.BARK, _bark)):
        chosen = np.flatnonzero(part == kind)
        if len(chosen):
            out[chosen] *= paint(local[chosen], shifted[chosen], style)
    printed = np.flatnonzero(part == MeshPart.TAG)
    if len(printed):
        out[printed] *= _print(local[printed], tag_print)
    return np.asarray(np.clip(out, 0.0, 1.0), np.float32)


def _skin(local: F32, shifted: F32, style: Style) -> F32:
    """Lenticels, patches of blush and the felt of young fruitlets."""
    dots = np.clip(noise(shifted, 0.7) - 0.62, 0, 1) * 1.6
    patches = 0.12 * noise(shifted, 5.0)
    felt = style.wool * (0.22 * grain(shifted, 0.16) + 0.16 * noise(shifted, 0.45))
    factor = (1 + dots + patches + felt)[:, None] * np.ones(3, np.float32)
    factor[:, 0] += 0.08 * noise(shifted + 31, 4.0)
    return np.asarray(np.clip(factor, 0.2, 2.0), np.float32)


def _veins(local: F32, shifted: F32, style: Style) -> F32:
    """A pale midrib and side veins, between blades of uneven green."""
    side = np.abs(local[:, 1])
    midrib = np.exp(-((side / 0.7) ** 2))
    phase = (local[:, 0] - 0.9 * side) / 6.5
    ridge = np.exp(-(((phase - np.round(phase)) * 6.5 / 0.45) ** 2)) * (side > 0.7)
    patches = 0.12 * noise(shifted, 9.0) + 0.07 * noise(shifted, 1.1)
    return np.asarray((1 + 0.5 * midrib + 0.25 * ridge + patches)[:, None] * np.ones(3, np.float32))


def _bark(local: F32, shifted: F32, style: Style) -> F32:
    rough = 0.3 * noise(shifted, 3.5) + 0.25 * noise(shifted * np.array([1, 1, 3], np.float32), 1.0)
    return np.asarray(np.clip(1 + rough, 0.2, 2)[:, None] * np.ones(3, np.float32))


def _print(local: F32, tag_print: F32) -> F32:
    """The printed black of the tag; the card's margin stays paper."""
    bit_mm = TAG_SIZE_MM / 8
    size = tag_print.shape[0]
    place = (local[:, :2] / bit_mm + 5) * _CELL_PX
    column, row = np.floor(place).astype(np.int32).T
    inside = (column >= 0) & (column < size) & (row >= 0) & (row < size)
    ink = np.ones(len(local), np.float32)
    ink[inside] = tag_print[row[inside], column[inside]]
    return np.asarray((0.06 + 0.94 * ink)[:, None] * np.ones(3, np.float32))
