"""Photographs of fruit with boxes in YOLO form: `FOLDER/*/images/X.jpg`, `FOLDER/*/labels/X.txt`.

A label is a line `class cx cy width height` in shares of the picture. Boxes go
round the visible part. A tile that cannot be used is named and left out.
"""

from __future__ import annotations

import json
import sys
import zlib
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from export.segmentation_window import F32, Window, no_boxes

PICTURES = {".jpg", ".jpeg", ".png"}
HELD_BACK_OF = 12
"""One photograph of so many is kept for validation."""
SLIVER_SHARE = 0.01
"""A box with a shorter side is what a tile's border left of a fruit: unknown."""


class LabelError(ValueError):
    """A label file says what cannot be; the message names the line."""


@dataclass(frozen=True, slots=True)
class Tile:
    """One photograph and its boxes, in shares of its size."""

    path: Path
    boxes: tuple[tuple[float, float, float, float], ...]
    """x0, y0, x1, y1."""
    unknown: tuple[tuple[float, float, float, float], ...] = ()

    @property
    def held_back(self) -> bool:
        """Whether the photograph that the tile was cut from is kept for validation."""
        photograph = self.path.stem.rsplit("_", 1)[0]
        return zlib.crc32(photograph.encode()) % HELD_BACK_OF == 0

    def read(self) -> Window | None:
        """The picture with its boxes; nothing, and a word, where it cannot be decoded."""
        data = np.fromfile(self.path, np.uint8)
        image = cv2.imdecode(data, cv2.IMREAD_COLOR_RGB) if len(data) else None
        if image is None:
            sys.stderr.write(f"{self.path.name} cannot be decoded and is left out.\n")
            return None
        height, width = image.shape[:2]
        labels = np.zeros((height, width), np.uint8)
        whole = np.zeros((0, height, width), bool)
        return Window(
            np.asarray(image, np.uint8),
            labels,
            whole,
            _in_px(self.boxes, width, height),
            _in_px(self.unknown, width, height),
        )


def _in_px(boxes: tuple[tuple[float, float, float, float], ...], width: int, height: int) -> F32:
    if not boxes:
        return no_boxes()
    scaled = np.array(boxes, np.float32) * np.array([width, height] * 2, np.float32)
    return np.asarray(np.clip(scaled, 0, [width, height] * 2), np.float32)


def read_labels(text: str) -> tuple[tuple[float, float, float, float], ...]:
    """Boxes x0, y0, x1, y1 of a label file, in shares of the picture, cut at its border.

    Boxes without width or height are stray clicks of the labelling program.

    Raises:
        LabelError: a line is not five numbers, or its box lies outside the picture.
    """
    boxes = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        try:
            _, cx, cy, width, height = (float(cell) for cell in line.split())
        except ValueError:
            raise LabelError(f"line {number} is not `class cx cy width height`") from None
        box = (
            max(cx - width / 2, 0.0), max(cy - height / 2, 0.0),
            min(cx + width / 2, 1.0), min(cy + height / 2, 1.0),
        )  # fmt: skip
        if not (width >= 0 and height >= 0 and box[0] <= box[2] and box[1] <= box[3]):
            raise LabelError(f"the box of line {number} lies outside the picture")
        if box[0] < box[2] and box[1] < box[3]:
            boxes.append(box)
    return tuple(boxes)


@dataclass(frozen=True, slots=True)
class RealTiles:
    """Tiles by their folder, so that small folders are not drowned by large ones."""

    folders: tuple[tuple[Tile, ...], ...] = field(default=())

    def pick(self, rng: np.random.Generator) -> Tile:
        """A random tile, a folder's chance growing with the root of its size."""
        shares = np.sqrt([len(tiles) for tiles in self.folders])
        tiles = self.folders[int(rng.choice(len(shares), p=shares / shares.sum()))]
        return tiles[int(rng.integers(len(tiles)))]

    def all(self) -> list[Tile]:
        """Every tile, folder by folder."""
        return [tile for tiles in self.folders for tile in tiles]


def list_tiles(folder: Path, held_back: bool, noted: Path | None = None) -> RealTiles:
    """The tiles to train on, or those held back; tiles with bad labels are named on stderr.

    `noted` is what `export.find_unknown` wrote of fruit that nobody boxed.
    """
    unknown = json.loads(noted.read_text("utf-8")) if noted else {}
    kinds = []
    for images in sorted(folder.glob("*/images")):
        tiles = [_tile(path, unknown) for path in sorted(images.iterdir())]
        usable = tuple(t for t in tiles if t is not None and t.held_back == held_back)
        if usable:
            kinds.append(usable)
    return RealTiles(tuple(kinds))


def _tile(path: Path, unknown: dict[str, list[list[float]]]) -> Tile | None:
    if path.suffix.lower() not in PICTURES:
        return None
    labels = path.parent.parent / "labels" / f"{path.stem}.txt"
    try:
        boxes = read_labels(labels.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, LabelError) as problem:
        sys.stderr.write(f"{path.name} is left out: {labels.name}: {problem}\n")
        return None
    faint = [(x0, y0, x1, y1) for x0, y0, x1, y1 in unknown.get(path.name, [])]
    slivers = [b for b in boxes if min(b[2] - b[0], b[3] - b[1]) < SLIVER_SHARE]
    return Tile(path, tuple(b for b in boxes if b not in slivers), (*slivers, *faint))
