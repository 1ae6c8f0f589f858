"""The cameras on this machine's USB ports, and one of them opened with all that it says
about itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import usb.core
from usb.backend import IBackend

from fieldcam.camera.usb3vision.bootstrap import (
    Abrm,
    Sbrm,
    channel_limits,
    read_abrm,
    read_eirm,
    read_sbrm,
)
from fieldcam.camera.usb3vision.channel import ControlChannel
from fieldcam.camera.usb3vision.description import Description, describe
from fieldcam.camera.usb3vision.events import EventChannel
from fieldcam.camera.usb3vision.manifest import newest_first, read_manifest
from fieldcam.camera.usb3vision.pyusb_transport import (
    CameraInterfaces,
    UsbLink,
    attached,
    link_speed,
    read_strings,
)
from fieldcam.camera.usb3vision.stream import ImageStream
from fieldcam.camera.usb3vision.transport import LinkSpeed
from fieldcam.errors import CameraUnplugged, DeviceError


@dataclass(frozen=True, slots=True)
class CameraNames:
    """What a camera's descriptors call it; empty where they do not."""

    vendor: str = ""
    model: str = ""
    serial: str = ""
    guid: str = ""
    """Stays with the camera wherever it is plugged in."""
    user_name: str = ""


@dataclass(frozen=True, slots=True)
class AttachedCamera:
    """What can be known of a camera without claiming it."""

    names: CameraNames
    usb_id: tuple[int, int]
    """Vendor and product."""
    bus: int
    address: int
    """A new one each time the camera is plugged in."""
    ports: tuple[int, ...]
    """From the root hub on; stays with the socket."""
    speed: LinkSpeed
    max_power: int
    """As its configuration says: units of 8 mA on USB 3, of 2 mA on USB 2."""
    trouble: DeviceError | None
    """Why its names could not be read."""

    @property
    def port(self) -> str:
        """As Linux names the socket, such as 2-1.3."""
        return port_name(self.bus, self.ports)

    @property
    def power_ma(self) -> int:
        """The most that it says it takes from the port."""
        return self.max_power * (8 if self.speed.is_usb3 else 2)


def port_name(bus: int, ports: tuple[int, ...]) -> str:
    """As Linux names a USB socket."""
    return f"{bus}-{'.'.join(map(str, ports)) or '?'}"


def attached_cameras(backend: IBackend | None = None) -> tuple[AttachedCamera, ...]:
    """All USB3 Vision cameras, by bus and socket; none of them is claimed.

    Raises UsbLibraryMissing where libusb is not installed.
    """
    found = (_look_at(device, interfaces) for device, interfaces in attached(backend))
    cameras = (camera for camera in found if camera is not None)
    return tuple(sorted(cameras, key=lambda camera: (camera.bus, camera.ports)))


def _look_at(device: usb.core.Device, interfaces: CameraInterfaces) -> AttachedCamera | None:
    """None where the camera went meanwhile."""
    trouble: DeviceError | None = None
    names = CameraNames()
    try:
        names = CameraNames(*read_strings(device, _name_indices(device, interfaces)))
    except CameraUnplugged:
        return None
    except DeviceError as error:
        trouble = error
    return AttachedCamera(
        names,
        usb_id=(device.idVendor, device.idProduct),
        bus=device.bus or 0,
        address=device.address or 0,
        ports=device.port_numbers or (),
        speed=link_speed(device),
        max_power=interfaces.max_power,
        trouble=trouble,
    )


def _name_indices(device: usb.core.Device, interfaces: CameraInterfaces) -> tuple[int, ...]:
    """In the order of CameraNames; the device descriptor's where the camera gives no other."""
    info = interfaces.info
    if info is None:
        return device.iManufacturer, device.iProduct, device.iSerialNumber, 0, 0
    return (
        info.vendor_index or device.iManufacturer,
        info.model_index or device.iProduct,
        info.serial_index or device.iSerialNumber,
        info.guid_index,
        info.user_name_index,
    )


class OpenCamera:
    """A claimed camera: its registers and its stream. Closing twice is fine."""

    def __init__(self, link: UsbLink) -> None:
        """Reads the camera's registers; raises CameraSilent, CameraUnsupported or
        CameraUnplugged, and leaves the link open then.
        """
        self._link = link
        self.speed = link.speed
        self.registers = ControlChannel(link.control_out, link.control_in)
        self.abrm: Abrm = read_abrm(self.registers)
        self.sbrm: Sbrm = read_sbrm(self.registers, self.abrm)
        self.registers.limits = channel_limits(self.abrm, self.sbrm)

    def description(self, cache: Path, given: Path | None = None) -> Description:
        """Its features; `given` is a file for a camera whose own cannot be read."""
        entries = newest_first(read_manifest(self.registers, self.abrm))
        return describe(self.registers, entries, cache, given)

    def stream(self) -> ImageStream:
        """The camera's image stream, not armed; one at a time."""
        return ImageStream(self._link.stream_in, self.registers, self.sbrm)

    def events(self) -> EventChannel | None:
        """The camera's event channel, not enabled; None where it has none."""
        eirm = read_eirm(self.registers, self.sbrm)
        if eirm is None or self._link.event_in is None:
            return None
        return EventChannel(self._link.event_in, self.registers, eirm)

    def close(self) -> None:
        """Release the camera; no thread may still read from it."""
        self._link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_attached(camera: AttachedCamera, backend: IBackend | None = None) -> OpenCamera:
    """Claim this camera; raises CameraBusy, CameraForbidden or CameraUnplugged."""
    return _opened(claim_attached(camera, backend))


def claim_attached(camera: AttachedCamera, backend: IBackend | None = None) -> UsbLink:
    """Its endpoints, without asking it anything; raises as `open_attached` does."""
    for device, interfaces in attached(backend):
        if (device.bus, device.address) == (camera.bus, camera.address):
            return UsbLink(device, interfaces)
    raise CameraUnplugged("The camera is gone.", "Check its cable at both ends.")


def _opened(link: UsbLink) -> OpenCamera:
    try:
        return OpenCamera(link)
    except BaseException:
        link.close()
        raise
