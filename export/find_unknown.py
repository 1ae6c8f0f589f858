"""Finds fruit that nobody boxed on photographs, so that it is not learnt as background.

    python -m export.find_unknown WEIGHTS --real ../shared/real/fruit --out unknown.json

Near fruit is boxed well, fruit of the trees behind mostly not. What a network takes
for fruit, no box covers, and is smaller than the boxed fruit of its tile may be such
fruit: training neither asks for it nor punishes it. The file names each tile's places
as shares of its size; `export.train_segmentation --unknown` takes it.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torchvision.ops import box_iou

from export.mask_rcnn import FruitletMaskRCNN
from export.real_tiles import Tile, list_tiles
from export.segmentation_state import load_weights

MIN_SCORE = 0.3
MAX_IOU = 0.2
SMALLER = 0.75
"""Of the median boxed side: fruit of this size stands a third farther away."""
TELL_EVERY = 100


def unboxed(found: Tensor, boxes: Tensor) -> Tensor:
    """(N,) bool: detections (N, 4) that no box (K, 4) covers, smaller than boxed fruit."""
    if not len(boxes):
        return torch.zeros(len(found), dtype=torch.bool)
    usual = _side(boxes).median()
    apart: Tensor = box_iou(found, boxes).amax(dim=1) < MAX_IOU
    return apart & (_side(found) < SMALLER * usual)


def _side(boxes: Tensor) -> Tensor:
    sides: Tensor = (boxes[:, 2:] - boxes[:, :2]).prod(dim=1).clamp(min=0).sqrt()
    return sides


@torch.no_grad()
def unknown_of(model: FruitletMaskRCNN, tile: Tile) -> list[list[float]]:
    """Places x0, y0, x1, y1 of a tile that may be fruit, as shares of its size."""
    window = tile.read()
    if window is None:
        return []
    pixels = torch.from_numpy(window.image.transpose(2, 0, 1).astype(np.float32))
    seen = model.detect(pixels)
    found = seen.boxes[seen.scores >= MIN_SCORE]
    kept = found[unboxed(found, torch.from_numpy(window.boxes))]
    height, width = window.labels.shape
    shares = kept / torch.tensor([width, height, width, height])
    return [[round(float(v), 5) for v in box] for box in shares]


def main(argv: list[str] | None = None) -> int:
    """Writes the places of all tiles, those held back too."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("weights", type=Path)
    parser.add_argument("--real", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args(argv)
    model, _ = load_weights(options.weights)
    tiles = [t for kept in (False, True) for t in list_tiles(options.real, kept).all()]
    places = {}
    for number, tile in enumerate(tiles, start=1):
        found = unknown_of(model, tile)
        if found:
            places[tile.path.name] = found
        if number % TELL_EVERY == 0:
            sys.stderr.write(f"{number} of {len(tiles)} tiles\n")
    part = options.out.with_suffix(".part")
    part.write_text(json.dumps(places), "utf-8")
    part.replace(options.out)
    sys.stderr.write(f"{sum(map(len, places.values()))} places in {len(places)} tiles\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
