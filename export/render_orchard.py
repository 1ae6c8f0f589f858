"""Renders whole pairs of the simulated orchard into a folder, with their truth.

`python -m export.render_orchard --out DIR --seed 7000001 --blocks 7 --clusters 10`
writes one folder for each capture: left.png, right.png, calibration.yml (as the
authors' camera dumps it) and truth.json. Captures that exist are kept.

Seeds from 7,000,000 on are for the published figures only; seeds from 6,000,000
on are for choosing thresholds and corrections.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.calibration.rectified_file import rectified_file
from fieldcam.simulator import BlockPlan, Faults, SimulatedCapture, Spoiling, TrueFruitlet, capture
from fieldcam.values import ImageU8

DAYS = (0.0, 2.0, 4.0)
TUNING = Path("export/.cache/tuning")
_TUNING_SEED, _TUNING_BLOCKS, _TUNING_CLUSTERS = 6_000_001, 8, 6


@dataclass(frozen=True, slots=True)
class Order:
    """Which capture to render."""

    seed: int
    clusters: int
    index: int
    day: float
    faults: Faults = field(default_factory=Faults)

    @property
    def name(self) -> str:
        fault = (
            ""
            if self.faults.kind is Spoiling.NONE
            else f"_{self.faults.kind}{self.faults.severity}"
        )
        return f"{self.seed}_{self.index:02d}_day{self.day:g}{fault}"

    def render(self) -> SimulatedCapture:
        block = BlockPlan.plan(self.seed, self.clusters)
        return capture(block, self.index, self.day, faults=self.faults)


def season(seed: int, blocks: int, clusters: int) -> Iterator[Order]:
    """Each cluster of some blocks once, on days that take turns."""
    for block in range(blocks):
        for index in range(clusters):
            yield Order(seed + block, clusters, index, DAYS[(block + index) % len(DAYS)])


def write(order: Order, folder: Path) -> None:
    """Render one capture into `folder`, unless it is there already."""
    if (folder / "truth.json").exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    done = order.render()
    _write_image(folder / "left.png", done.raw.left)
    _write_image(folder / "right.png", done.raw.right)
    (folder / "calibration.yml").write_bytes(rectified_file(done.calibration))
    (folder / "truth.json").write_text(json.dumps(_truth(order, done)))
    window = _target_window(done)
    np.savez_compressed(
        folder / "disparity.npz",
        x0=window[1].start,
        y0=window[0].start,
        disparity_px=done.truth.left_disparity_px[window],
        matched=done.truth.left_matched[window],
        fruit=_fruit_map(done)[window],
    )


def render_tuning() -> None:
    """The pairs on which thresholds and corrections are chosen, in TUNING."""
    for order in season(_TUNING_SEED, _TUNING_BLOCKS, _TUNING_CLUSTERS):
        write(order, TUNING / order.name)


def _truth(order: Order, done: SimulatedCapture) -> dict[str, object]:
    return {
        "tag": done.truth.tag_id,
        "tag_range_mm": done.truth.tag_center_mm[2],
        "fault": order.faults.kind,
        "severity": order.faults.severity,
        "fruitlets": [_fruitlet(f) for f in done.truth.fruitlets],
    }


def _fruitlet(fruitlet: TrueFruitlet) -> dict[str, object]:
    return {
        "id": fruitlet.id,
        "in_target": fruitlet.in_target,
        "diameter_mm": fruitlet.diameter_mm,
        "visible_fraction": fruitlet.visible_fraction,
        "center_px": fruitlet.center_px,
        "box_px": fruitlet.box_px,
        "range_mm": fruitlet.range_mm,
        "visible_px": fruitlet.visible.area_px,
    }


def _fruit_map(done: SimulatedCapture) -> npt.NDArray[np.uint8]:
    """Visible pixels of fruitlet k (from 1) over the whole left image."""
    labels = np.zeros(done.raw.left.shape[:2], np.uint8)
    for k, fruitlet in enumerate(done.truth.fruitlets):
        labels[fruitlet.visible.region.slices][fruitlet.visible.window] = k + 1
    return labels


def _target_window(done: SimulatedCapture) -> tuple[slice, slice]:
    """Rows and columns around the target's visible fruitlets."""
    boxes = np.array([f.box_px for f in done.truth.target] or [(0.0, 0.0, 8.0, 8.0)])
    x0, y0 = np.maximum(boxes[:, :2].min(axis=0) - 40, 0).astype(int)
    x1, y1 = (boxes[:, 2:].max(axis=0) + 40).astype(int)
    return slice(int(y0), int(y1)), slice(int(x0), int(x1))


def _write_image(path: Path, image: ImageU8) -> None:
    if not cv2.imwrite(str(path), cv2.cvtColor(image, cv2.COLOR_RGB2BGR)):
        raise OSError(f"cannot write {path}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--blocks", type=int, default=7)
    parser.add_argument("--clusters", type=int, default=10)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    for order in season(arguments.seed, arguments.blocks, arguments.clusters):
        write(order, arguments.out / order.name)


if __name__ == "__main__":
    main()
