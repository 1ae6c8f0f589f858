"""Stereo heads of every shape, plugged in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from .bus import UsbBus
from .camera import Camera
from .descriptors import Identity, Speed
from .head import Head
from .pictures import PictureSource
from .sensor import Eyes, Sensor

LEFT_SERIAL, RIGHT_SERIAL, HEAD_SERIAL = "EMU-LEFT-01", "EMU-RIGHT-02", "EMU-HEAD-03"


class Shape(StrEnum):
    """How the two eyes reach the host."""

    TWO_DEVICES = "two-devices"
    """The left one has the flash and, over the wire, triggers the right one."""
    SIDE_BY_SIDE = "side-by-side"
    ALTERNATING = "alternating"


@dataclass(frozen=True, slots=True)
class StereoHead:
    """A head and its cameras, left before right."""

    head: Head
    cameras: tuple[Camera, ...]

    def plug(self, speed: Speed = Speed.SUPER) -> None:
        """Plug all in, those that are plugged in already after pulling them."""
        self.unplug()
        for camera in self.cameras:
            self.head.bus.plug(camera, speed)

    def unplug(self) -> None:
        for camera in self.cameras:
            self.head.bus.unplug(camera)


def stereo_head(bus: UsbBus, shape: Shape, source: PictureSource, eye: Sensor) -> StereoHead:
    """A head of this shape, not plugged in yet; `eye` says what one eye is like."""
    head = Head(bus, source)
    parts = {
        Shape.TWO_DEVICES: ((Eyes.LEFT, LEFT_SERIAL), (Eyes.RIGHT, RIGHT_SERIAL)),
        Shape.SIDE_BY_SIDE: ((Eyes.BESIDE, HEAD_SERIAL),),
        Shape.ALTERNATING: ((Eyes.ALTERNATING, HEAD_SERIAL),),
    }[shape]
    cameras = tuple(
        Camera(Identity(serial), replace(eye, eyes=eyes), head) for eyes, serial in parts
    )
    return StereoHead(head, cameras)
