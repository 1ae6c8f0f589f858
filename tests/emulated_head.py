"""The emulated head behind the driver, in this process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from emulated_camera.backend import EmulatedBackend
from emulated_camera.bus import UsbBus
from emulated_camera.camera import Camera
from emulated_camera.faults import Fault
from emulated_camera.pictures import PictureSource, gradients
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import Shape, StereoHead, stereo_head

from fieldcam.camera.finding import HeadFinder
from fieldcam.camera.head.device import UsbStereoHead
from fieldcam.camera.head.opening import Usb
from fieldcam.camera.usb3vision.devices import attached_cameras, open_attached

WIDTH, HEIGHT, DISPARITY = 320, 240, 32
SMALL = Sensor(width_px=WIDTH, height_px=HEIGHT)
SCENE = gradients(WIDTH, HEIGHT, DISPARITY)
DEADLINE_S = 2.0
QUICK = "flash_pause_s = 0\n"
"""Of camera.toml: nothing is charged here."""


class Bench:
    """A head on a bus of its own, a data folder, and what opens the head from there."""

    def __init__(
        self,
        folder: Path,
        shape: Shape = Shape.TWO_DEVICES,
        source: PictureSource = SCENE,
        eye: Sensor = SMALL,
    ) -> None:
        self.folder = folder
        self.bus = UsbBus()
        self.emulated: StereoHead = stereo_head(self.bus, shape, source, eye)
        self.emulated.plug()
        self.backend = EmulatedBackend(self.bus)
        backend = self.backend
        self.usb = Usb(partial(attached_cameras, backend), partial(open_attached, backend=backend))
        self.finder = HeadFinder(folder, self.usb)
        self.write(QUICK)

    @property
    def cameras(self) -> tuple[Camera, ...]:
        return self.emulated.cameras

    def write(self, settings: str) -> None:
        """As camera.toml; counts from the next opening on."""
        (self.folder / "camera.toml").write_text(settings)

    def arm(self, fault: Fault, times: float = 1, skip: int = 0) -> None:
        """In the left, or only, camera."""
        self.cameras[0].faults.arm(fault, times, skip)

    @contextmanager
    def opened(self, settings: str = QUICK) -> Iterator[UsbStereoHead]:
        self.write(settings)
        with self.finder.open() as head:
            yield head
