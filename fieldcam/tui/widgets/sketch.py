"""What is drawn where a picture is shown: pixels, and what is written on them."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import Protocol

import numpy as np

from fieldcam.growth.places import Place
from fieldcam.session.state import Shown
from fieldcam.tui.text.letters import BLOCK, big
from fieldcam.tui.widgets.picture import CHOSEN, OUTLINE, STRUCK, Colour, Cutout, frame_of, still
from fieldcam.values import Fruitlet, ImageU8

Size = tuple[int, int]
"""Width and height, in small pixels."""
REACH = 1.5
"""How near to a fruitlet is meant to be on it, in its own radii."""
MIN_REACH = 3.0
"""Small pixels."""


@dataclass(frozen=True, slots=True)
class Label:
    """A letter or number; its middle is at (x, y) in small pixels."""

    x: float
    y: float
    text: str
    ground: Colour


@dataclass(frozen=True, slots=True, eq=False)
class Painted:
    """A drawing, (height, width, 3), and what is written on it."""

    image: ImageU8
    labels: tuple[Label, ...] = ()


class Sketch(Protocol):
    """Something that can be drawn in any size."""

    @property
    def key(self) -> object:
        """Equal where the same would be drawn: drawing takes longer than all other widgets."""
        ...

    def paint(self, size: Size) -> Painted:
        """Raises OSError and ImageUnreadable, of which `not_there` makes a sentence."""
        ...

    def at(self, x: float, y: float, size: Size) -> Place | None:
        """The fruitlet at this small pixel."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Still:
    """One picture with its target and the letters of the list; one fruitlet may stand out."""

    shown: Shown
    chosen: int | None = None

    @property
    def key(self) -> object:
        return self.shown.left, self.shown.record.reading, self.chosen

    def paint(self, size: Size) -> Painted:
        image = still(self.shown, size, self.chosen)
        return Painted(image, tuple(self._label(each, size) for each in targets(self.shown)))

    def at(self, x: float, y: float, size: Size) -> Place | None:
        return nearest(self.shown, self._frame(size), x, y) if targets(self.shown) else None

    def _frame(self, size: Size) -> Cutout:
        """Of a target that was found, so that the image's own size is no matter."""
        return frame_of(self.shown.reading, (1, 1), size)

    def _label(self, fruitlet: Fruitlet, size: Size) -> Label:
        x, y = self._frame(size).place(fruitlet.center_px)
        living = {seen.id: seen.living for seen in self.shown.target}
        ground = OUTLINE if living[fruitlet.id] else STRUCK
        ground = CHOSEN if fruitlet.id == self.chosen else ground
        return Label(x, y, letter_in(self.shown, fruitlet.id), ground)


def letter_in(shown: Shown, fruitlet: int) -> str:
    """What a fruitlet of this picture is called; empty before it is read."""
    reading = shown.record.reading
    return "" if reading is None else reading.letter(fruitlet)


def targets(shown: Shown) -> tuple[Fruitlet, ...]:
    """The fruitlets of the target cluster, with the operator's correction of it."""
    ids = {seen.id for seen in shown.target}
    fruitlets = () if shown.reading is None else shown.reading.fruitlets
    return tuple(fruitlet for fruitlet in fruitlets if fruitlet.id in ids)


def living(shown: Shown) -> tuple[Fruitlet, ...]:
    """Those of the target that count."""
    ids = {seen.id for seen in shown.target if seen.living}
    return tuple(fruitlet for fruitlet in targets(shown) if fruitlet.id in ids)


def nearest(shown: Shown, frame: Cutout, x: float, y: float) -> Place | None:
    """The target's fruitlet at this small pixel of the picture."""
    found = targets(shown)
    if shown.record.reading is None or not found:
        return None

    def distance(fruitlet: Fruitlet) -> float:
        column, row = frame.place(fruitlet.center_px)
        return hypot(column - x, row - y)

    closest = min(found, key=distance)
    x0, y0, x1, y1 = closest.box_px
    radius = max(x1 - x0, y1 - y0) / 2 / frame.px_per_cell
    if distance(closest) > max(REACH * radius, MIN_REACH):
        return None
    return Place(shown.record.reading.id, closest.id)


def stamped(painted: Painted, scale: int) -> ImageU8:
    """The labels as pixels: signs of five rows of `scale` pixels each."""
    image = painted.image.copy()
    for label in painted.labels:
        dots = np.array([[letter == BLOCK for letter in line] for line in big(label.text)])
        dots = np.pad(dots.repeat(scale, 0).repeat(scale, 1), scale)
        height, width = dots.shape
        top = int(np.clip(label.y - height / 2, 0, max(0, image.shape[0] - height)))
        left = int(np.clip(label.x - width / 2, 0, max(0, image.shape[1] - width)))
        part = image[top : top + height, left : left + width]
        inside = dots[: part.shape[0], : part.shape[1], None]
        part[:] = np.where(inside, 0, np.array(label.ground, np.uint8))
    return image
