"""The still picture as a small colour array, with the target's outlines; numpy only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldcam.errors import ImageUnreadable
from fieldcam.images.pixels import BAYER_CELLS, as_rgb
from fieldcam.session.decoding import stored_image
from fieldcam.session.state import Shown
from fieldcam.values import ClusterReading, Ellipse, ImageU8, PixelFormat

RESTORE = "Copy it back from a backup of the data folder; its sizes are kept."
Colour = tuple[int, int, int]
OUTLINE: Colour = (255, 255, 255)
ASKED: Colour = (255, 215, 95)
STRUCK: Colour = (255, 90, 90)
CHOSEN: Colour = (90, 200, 255)
"""As in the themes: white is, yellow asks, red is bad or struck out, blue is in hand."""
MARGIN = 1.25
"""Of what is shown around the cluster, against its own extent."""
MIN_PX = 240.0


def still(
    shown: Shown,
    size: tuple[int, int],
    chosen: int | None = None,
    frame: Cutout | None = None,
) -> ImageU8:
    """The picture that is decided on, `size` being width and height in small pixels.

    The outline of the chosen fruitlet stands out. Without a `frame` the target is shown
    with its tag.
    Raises OSError and ImageUnreadable, of which `not_there` makes a sentence.
    """
    raw = stored_image(shown.left)
    image = colours(raw, shown.pixel_format)
    frame = frame or frame_of(shown.reading, (raw.shape[1], raw.shape[0]), size)
    shares = image.shape[0] / raw.shape[0]
    own = Cutout(frame.x0 * shares, frame.y0 * shares, frame.px_per_cell * shares)
    small = shrink(image, own, size)
    living = {seen.id: seen.living for seen in shown.target}
    for fruitlet in () if shown.reading is None else shown.reading.fruitlets:
        if fruitlet.id in living and fruitlet.outline is not None:
            draw(small, frame, fruitlet.outline, OUTLINE if living[fruitlet.id] else STRUCK)
            if fruitlet.id == chosen:
                draw(small, frame, fruitlet.outline, CHOSEN)
    return small


def not_there(error: OSError | ImageUnreadable) -> str:
    """Why there is no picture, and what to do."""
    if isinstance(error, FileNotFoundError):
        return f"The file of this picture is missing. {RESTORE}"
    if isinstance(error, OSError):
        return f"The file of this picture cannot be read: {error.strerror}."
    return f"The file of this picture is damaged. {RESTORE}"


@dataclass(frozen=True, slots=True)
class Cutout:
    """The part of an image that is shown, in its pixels."""

    x0: float
    y0: float
    px_per_cell: float
    """Image pixels in one pixel of the small picture."""

    def place(self, px: tuple[float, float]) -> tuple[float, float]:
        """Where a point of the image is in the small picture."""
        x, y = px
        return (x + 0.5 - self.x0) / self.px_per_cell, (y + 0.5 - self.y0) / self.px_per_cell


def colours(image: ImageU8, pixel_format: PixelFormat) -> ImageU8:
    """(H, W, 3), a Bayer image at half its resolution."""
    if image.ndim == 3 or pixel_format not in BAYER_CELLS:
        return as_rgb(image)
    rows, columns = image.shape[0] // 2 * 2, image.shape[1] // 2 * 2
    even = image[:rows, :columns]
    red, green, _, blue = BAYER_CELLS[pixel_format]
    return np.stack([even[r::2, c::2] for r, c in (red, green, blue)], axis=2)


def frame_of(
    reading: ClusterReading | None, image_px: tuple[int, int], size: tuple[int, int]
) -> Cutout:
    """Around the target and its tag, else the whole image; `size` is width and height."""
    boxes = [] if reading is None else [f.box_px for f in reading.target]
    if reading is not None and reading.tag is not None:
        boxes += [(*corner, *corner) for corner in reading.tag.corners_px]
    if not boxes:
        return _framed((0.0, 0.0), (float(image_px[0]), float(image_px[1])), 1.0, 0.0, size)
    return frame_around(boxes, size)


def frame_around(
    boxes: Sequence[tuple[float, float, float, float]], size: tuple[int, int]
) -> Cutout:
    """Around all of these boxes, each x0, y0, x1, y1."""
    low, high = np.array(boxes)[:, :2].min(axis=0), np.array(boxes)[:, 2:].max(axis=0)
    return _framed(low, high, MARGIN, MIN_PX, size)


def _framed(
    low: Sequence[float],
    high: Sequence[float],
    margin: float,
    least: float,
    size: tuple[int, int],
) -> Cutout:
    (x0, y0), (x1, y1) = low, high
    scale = max((x1 - x0) * margin / size[0], (y1 - y0) * margin / size[1], least / size[0])
    middle_x, middle_y = (x0 + x1) / 2, (y0 + y1) / 2
    return Cutout(
        float(middle_x - scale * size[0] / 2), float(middle_y - scale * size[1] / 2), scale
    )


def shrink(image: ImageU8, frame: Cutout, size: tuple[int, int]) -> ImageU8:
    """Block means of the frame, black outside the image; (height, width, 3)."""
    width, height = size
    columns = np.round(frame.x0 + np.arange(width + 1) * frame.px_per_cell).astype(int)
    rows = np.round(frame.y0 + np.arange(height + 1) * frame.px_per_cell).astype(int)
    small = np.zeros((height, width, 3), np.uint8)
    inside_x = [i for i in range(width) if columns[i] >= 0 and columns[i + 1] <= image.shape[1]]
    inside_y = [i for i in range(height) if rows[i] >= 0 and rows[i + 1] <= image.shape[0]]
    if not inside_x or not inside_y:
        return small
    x, y = slice(inside_x[0], inside_x[-1] + 1), slice(inside_y[0], inside_y[-1] + 1)
    part = image[rows[y.start] : rows[y.stop], columns[x.start] : columns[x.stop]]
    # A picture smaller than its cells repeats its last pixels.
    first_rows = np.minimum(rows[y] - rows[y.start], part.shape[0] - 1)
    first_columns = np.minimum(columns[x] - columns[x.start], part.shape[1] - 1)
    sums = np.add.reduceat(part, first_rows, axis=0, dtype=np.uint32)
    sums = np.add.reduceat(sums, first_columns, axis=1, dtype=np.uint32)
    heights = np.diff(rows[y.start : y.stop + 1])[:, None, None]
    widths = np.diff(columns[x.start : x.stop + 1])[None, :, None]
    small[y, x] = sums // np.maximum(heights * widths, 1)
    return small


def draw(small: ImageU8, frame: Cutout, ellipse: Ellipse, colour: Colour) -> None:
    """An outline, onto the small picture."""
    x, y = ellipse.points_px(160).T
    columns = np.floor((x + 0.5 - frame.x0) / frame.px_per_cell).astype(int)
    rows = np.floor((y + 0.5 - frame.y0) / frame.px_per_cell).astype(int)
    inside = (rows >= 0) & (rows < small.shape[0]) & (columns >= 0) & (columns < small.shape[1])
    small[rows[inside], columns[inside]] = colour


def draw_line(
    small: ImageU8,
    start: tuple[float, float],
    end: tuple[float, float],
    colour: Colour,
    dash: int | None = None,
) -> None:
    """From one small pixel to another; `dash` pixels on and as many off."""
    steps = int(max(abs(end[0] - start[0]), abs(end[1] - start[1]))) + 1
    along = np.linspace(0, 1, steps + 1)
    if dash is not None:
        along = along[np.arange(steps + 1) // dash % 2 == 0]
    columns = np.floor(start[0] + along * (end[0] - start[0])).astype(int)
    rows = np.floor(start[1] + along * (end[1] - start[1])).astype(int)
    inside = (rows >= 0) & (rows < small.shape[0]) & (columns >= 0) & (columns < small.shape[1])
    small[rows[inside], columns[inside]] = colour
