"""Pictures of calibration boards by a stereo head that is known exactly.

Each pixel's ray is bent back through the lens and meets the board's plane; nothing
here uses what solves for the camera.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import cv2
import numpy as np
import numpy.typing as npt

from fieldcam.values import ImageU8

Array = npt.NDArray[np.float64]

SAMPLES = 4
"""To a side of a pixel, to soften edges."""
DARK, LIGHT, BEHIND = 30.0, 205.0, 95.0
CELLS_PER_SQUARE = 9
"""Of a ChArUco board: seven of the marker, one of white on each side."""


@dataclass(frozen=True, slots=True)
class Lens:
    """A pinhole with plumb-bob distortion."""

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...]
    """k1, k2, p1, p2, k3."""

    def distorted(self, x: Array, y: Array) -> tuple[Array, Array]:
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return (
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        )

    def seen(self, points: Array) -> Array:
        """(N, 2) pixels of (N, 3) points in the eye's own frame."""
        x, y = self.distorted(points[:, 0] / points[:, 2], points[:, 1] / points[:, 2])
        return np.column_stack((self.fx * x + self.cx, self.fy * y + self.cy))

    def shrunk(self, times: int) -> Lens:
        cx, cy = ((c + 0.5) / times - 0.5 for c in (self.cx, self.cy))
        return Lens(self.fx / times, self.fy / times, cx, cy, self.distortion)


@dataclass(frozen=True, slots=True, eq=False)
class Head:
    """Two lenses; the right one's frame is rotation @ point + translation."""

    left: Lens
    right: Lens
    rotation: Array
    translation_mm: Array
    size_px: tuple[int, int] = (1440, 1080)

    @property
    def baseline_mm(self) -> float:
        return float(np.linalg.norm(self.translation_mm))

    def shrunk(self, times: int) -> Head:
        width, height = self.size_px
        return replace(
            self,
            left=self.left.shrunk(times),
            right=self.right.shrunk(times),
            size_px=(width // times, height // times),
        )

    def right_pose(self, pose: Pose) -> Pose:
        return Pose(
            self.rotation @ pose.rotation, self.rotation @ pose.place_mm + self.translation_mm
        )


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Board points become rotation @ point + place."""

    rotation: Array
    place_mm: Array


@dataclass(frozen=True, slots=True, eq=False)
class Printed:
    """A board as it lies on the paper: cells from its upper left corner, 0 or 255."""

    cells: ImageU8
    cell_mm: float

    @property
    def size_mm(self) -> tuple[float, float]:
        rows, columns = self.cells.shape
        return columns * self.cell_mm, rows * self.cell_mm


def printed_checkerboard(columns: int, rows: int, square_mm: float) -> Printed:
    cells = (np.add.outer(np.arange(rows), np.arange(columns)) % 2 * 255).astype(np.uint8)
    return Printed(cells, square_mm)


def printed_charuco(
    columns: int,
    rows: int,
    square_mm: float,
    family: int = cv2.aruco.DICT_5X5_1000,
    older: bool = False,
) -> Printed:
    """`older`: as OpenCV drew it before 4.6."""
    markers = cv2.aruco.getPredefinedDictionary(family)
    board = cv2.aruco.CharucoBoard((columns, rows), 9.0, 7.0, markers)
    board.setLegacyPattern(older)
    size = columns * CELLS_PER_SQUARE, rows * CELLS_PER_SQUARE
    cells = np.asarray(board.generateImage(size, marginSize=0, borderBits=1), np.uint8)
    return Printed(cells, square_mm / CELLS_PER_SQUARE)


def random_head(rng: np.random.Generator) -> Head:
    """As the published calibrations of the authors' camera vary."""

    def lens() -> Lens:
        fx = rng.uniform(1700, 1770)
        return Lens(
            fx,
            fx * rng.uniform(0.999, 1.001),
            rng.uniform(690, 780),
            rng.uniform(480, 560),
            (
                rng.normal(-0.29, 0.01),
                rng.normal(0.18, 0.02),
                rng.normal(0, 0.0015),
                rng.normal(0, 0.0015),
                0.0,
            ),
        )

    turn = rng.normal(0, (0.004, 0.012, 0.004))
    translation = np.array([-1.0, *rng.normal(0, 0.006, 2)])
    translation *= rng.uniform(59.8, 60.3) / np.linalg.norm(translation)
    return Head(lens(), lens(), np.asarray(cv2.Rodrigues(turn)[0], np.float64), translation)


def random_poses(
    rng: np.random.Generator, head: Head, board: Printed, count: int, whole: bool = True
) -> Iterator[Pose]:
    """Spread over the picture, tilted every way, 320 to 620 mm away.

    `whole`: both eyes see all of it, as a checkerboard needs.
    """
    given = 0
    while given < count:
        pose = random_pose(rng, head, board)
        if not whole or all(_inside(head, board, pose)):
            given += 1
            yield pose


def random_pose(rng: np.random.Generator, head: Head, board: Printed) -> Pose:
    direction, tilt = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(0, 40))
    tilted = cv2.Rodrigues(tilt * np.array([np.cos(direction), np.sin(direction), 0]))[0]
    rolled = cv2.Rodrigues(np.array([0, 0, rng.normal(0, 0.25)]))[0]
    rotation = np.asarray(tilted @ rolled, np.float64)
    range_mm = rng.uniform(320, 620)
    width, height = head.size_px
    u, v = rng.uniform(0.1, 0.9) * width, rng.uniform(0.1, 0.9) * height
    lens = head.left
    middle = np.array([(u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy, 1.0]) * range_mm
    return Pose(rotation, middle - rotation @ np.array([*board.size_mm, 0.0]) / 2)


def _inside(head: Head, board: Printed, pose: Pose) -> Iterator[bool]:
    width, height = head.size_px
    outline = np.array(
        [(x, y, 0) for x in (-3, board.size_mm[0] + 3) for y in (-3, board.size_mm[1] + 3)]
    )
    for lens, own in ((head.left, pose), (head.right, head.right_pose(pose))):
        points = outline @ own.rotation.T + own.place_mm
        u, v = lens.seen(points).T
        margin = width / 180
        yield bool(
            (points[:, 2] > 0).all()
            and (margin < u).all()
            and (u < width - margin).all()
            and (margin < v).all()
            and (v < height - margin).all()
        )


def photograph(
    head: Head,
    board: Printed,
    pose: Pose,
    rng: np.random.Generator,
    *,
    right: Pose | None = None,
    blur_px: float = 0.8,
    noise: float = 2.0,
) -> tuple[ImageU8, ImageU8]:
    """Both eyes' grey pictures; `right`: where the board was when the right eye looked."""
    poses = pose, head.right_pose(right or pose)
    left, right_picture = (
        _picture(lens, head.size_px, board, own, rng, blur_px, noise)
        for lens, own in zip((head.left, head.right), poses, strict=True)
    )
    return left, right_picture


def _picture(
    lens: Lens,
    size_px: tuple[int, int],
    board: Printed,
    pose: Pose,
    rng: np.random.Generator,
    blur_px: float,
    noise: float,
) -> ImageU8:
    rays = _rays(lens, size_px)
    normal = pose.rotation[:, 2]
    range_mm = (normal @ pose.place_mm) / (rays @ normal)
    on_board = (rays * range_mm[..., None] - pose.place_mm) @ pose.rotation[:, :2] / board.cell_mm
    value = _softened(board, on_board)
    rows, columns = np.mgrid[0 : size_px[1], 0 : size_px[0]]
    # A flash lights the middle most.
    away = np.hypot(columns / size_px[0] - 0.5, rows / size_px[1] - 0.45)
    lit = value * (1.05 - 0.5 * away**2)
    blurred = cv2.GaussianBlur(lit.astype(np.float32), (0, 0), blur_px)
    noisy = blurred + rng.normal(0, noise, blurred.shape)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), np.uint8)


def _softened(board: Printed, on_board: Array) -> Array:
    """Mean over each pixel, inside which the board's coordinates are as good as linear."""
    paper = DARK + (LIGHT - DARK) * np.pad(board.cells, 1, constant_values=255) / 255.0
    margin = 6.0 / board.cell_mm  # of white paper around the board
    rows, columns = board.cells.shape
    value = np.full(on_board.shape[:2], BEHIND)
    nearly = np.abs(on_board - (columns / 2, rows / 2)) < (
        columns / 2 + margin * 2,
        rows / 2 + margin * 2,
    )
    seen = np.argwhere(nearly.all(axis=2))
    if not len(seen):
        return value
    part = tuple(slice(a, b + 1) for a, b in zip(seen.min(axis=0), seen.max(axis=0), strict=True))
    on_board = on_board[part]
    down, across = np.gradient(on_board, axis=(0, 1))
    total = np.zeros(on_board.shape[:2])
    steps = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    for dx, dy in product(steps, steps):
        x, y = np.moveaxis(on_board + dx * across + dy * down, 2, 0)
        column = np.clip(np.floor(x), -1, columns).astype(np.intp) + 1
        row = np.clip(np.floor(y), -1, rows).astype(np.intp) + 1
        off = (x < -margin) | (y < -margin) | (x > columns + margin) | (y > rows + margin)
        total += np.where(off, BEHIND, paper[row, column])
    value[part] = total / SAMPLES**2
    return value


@lru_cache(maxsize=2)
def _rays(lens: Lens, size_px: tuple[int, int]) -> Array:
    """(H, W, 3), z = 1: where each pixel looks, the lens undone by fixed-point steps."""
    rows, columns = np.mgrid[0 : size_px[1], 0 : size_px[0]].astype(np.float64)
    wanted_x, wanted_y = (columns - lens.cx) / lens.fx, (rows - lens.cy) / lens.fy
    x, y = wanted_x.copy(), wanted_y.copy()
    for _ in range(25):
        found_x, found_y = lens.distorted(x, y)
        x += wanted_x - found_x
        y += wanted_y - found_y
    return np.stack((x, y, np.ones_like(x)), axis=2)
