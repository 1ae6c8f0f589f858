"""Makes one pair of what a head's cameras sent after one trigger, for each way to carry it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from fieldcam.camera.head.settings import Carrying
from fieldcam.camera.usb3vision.clocks import DeviceClock
from fieldcam.camera.usb3vision.pairing import (
    AlternatePairing,
    Eye,
    EyeLayout,
    EyePair,
    Half,
    TwinPairing,
    split,
)

TOLERANCE_NS = 10_000_000
"""Well above what latching a clock over a busy bus is off, well below two exposures."""
WORDS = {
    Carrying.TWO_DEVICES: "one eye's",
    Carrying.SIDE_BY_SIDE: "both eyes' side by side",
    Carrying.STACKED: "both eyes' one above the other",
    Carrying.ALTERNATING: "the left and the right eye's in turn",
}
"""Whose pictures a camera sends."""
LAYOUTS = {Carrying.SIDE_BY_SIDE: EyeLayout.SIDE_BY_SIDE, Carrying.STACKED: EyeLayout.STACKED}


class Assembly(Protocol):
    """One for each way."""

    @property
    def blocks(self) -> int:
        """How many each camera sends of one exposure."""
        ...

    def pair(
        self, received: Sequence[Sequence[Half]], clocks: Mapping[Eye, DeviceClock]
    ) -> EyePair | None:
        """The pair of what each camera sent, cameras in the head's order (left first);
        None where it is not of one exposure.
        """
        ...

    def restart(self) -> None:
        """Something was lost, or the streams were armed anew."""
        ...


class Twins:
    """Two cameras."""

    blocks = 1

    def __init__(self) -> None:
        self._pairing = TwinPairing(TOLERANCE_NS)

    def pair(
        self, received: Sequence[Sequence[Half]], clocks: Mapping[Eye, DeviceClock]
    ) -> EyePair | None:
        self._pairing.clocks = dict(clocks)
        found = None
        for eye, halves in zip(Eye, received, strict=True):
            for half in halves:
                found = self._pairing.add(eye, half) or found
        return found

    def restart(self) -> None:
        self._pairing.restart()


class Joined:
    """One camera whose image holds both eyes."""

    blocks = 1

    def __init__(self, layout: EyeLayout) -> None:
        self._layout = layout

    def pair(
        self, received: Sequence[Sequence[Half]], clocks: Mapping[Eye, DeviceClock]
    ) -> EyePair | None:
        return split(received[0][0], self._layout)

    def restart(self) -> None:
        """Nothing is kept from one exposure to the next."""


class Alternating:
    """One camera that sends the left eye's block, then the right one's."""

    blocks = 2

    def __init__(self) -> None:
        self._pairing: AlternatePairing | None = None

    def pair(
        self, received: Sequence[Sequence[Half]], clocks: Mapping[Eye, DeviceClock]
    ) -> EyePair | None:
        """Some cameras count their blocks from 0, some from 1."""
        if self._pairing is None:
            self._pairing = AlternatePairing(received[0][0].block_id % 2)
        found = None
        for half in received[0]:
            found = self._pairing.add(half) or found
        return found

    def restart(self) -> None:
        """Which blocks are the left eye's stays the same while the camera is open."""


def assembly(carrying: Carrying) -> Assembly:
    match carrying:
        case Carrying.TWO_DEVICES:
            return Twins()
        case Carrying.ALTERNATING:
            return Alternating()
        case _:
            return Joined(LAYOUTS[carrying])


def told_by_image(size_px: tuple[int, int], sources: int) -> Carrying:
    """What an image (width, height) of a camera with so many image sources looks like;
    TWO_DEVICES: it is one eye's.
    """
    width_px, height_px = size_px
    if sources > 1:
        return Carrying.ALTERNATING
    if width_px >= 2 * height_px:
        return Carrying.SIDE_BY_SIDE
    return Carrying.STACKED if height_px > width_px else Carrying.TWO_DEVICES


def layout_doubt(carrying: Carrying, size_px: tuple[int, int], sources: int) -> str | None:
    """A sentence where an image does not look like what it is taken for.

    A doubt only: eyes may stand upright, and pictures be cut to any size.
    """
    looks_like = told_by_image(size_px, sources)
    if looks_like is carrying:
        return None
    width_px, height_px = size_px
    return (
        f"Pictures of {width_px} x {height_px} pixels are taken for {WORDS[carrying]}, but look"
        f" like {WORDS[looks_like]}: check `layout` in camera.toml."
    )
