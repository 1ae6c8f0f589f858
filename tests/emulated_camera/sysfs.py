"""The files by which Linux shows a USB device, below a folder that umockdev's preload shows.

Each attribute is one that libusb 1.0 reads, with or without udev.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from . import descriptors
from .bus import Plugged

UNREADABLE = Path("/proc/sys/kernel/version")
"""A file that not even root may open for writing: it stands for one that lacks a udev rule."""
_CONTROLLER = "devices/pci0000:00/0000:00:14.0"
_MAJOR = 189


class Tree:
    """`sys` and `dev` below a root."""

    def __init__(self, root: Path) -> None:
        self._root = root
        for folder in ("sys/bus/usb/devices", "sys/class", "dev/bus/usb", "ioctl/dev/bus/usb"):
            (root / folder).mkdir(parents=True)

    def socket(self, plugged: Plugged) -> Path:
        """Where the preload connects for the ioctls of an opened device."""
        path = self._root / "ioctl" / node(plugged).lstrip("/")
        path.parent.mkdir(exist_ok=True)
        return path

    def add(self, plugged: Plugged) -> None:
        folder = self._root / "sys" / device_path(plugged).lstrip("/")
        folder.mkdir(parents=True)
        for name, content in _attributes(plugged).items():
            (folder / name).write_bytes(content)
        # Relative links, since a process that sees them does not see the root.
        (folder / "subsystem").symlink_to("../../../../../bus/usb")
        self._node(plugged)
        self._link(plugged).symlink_to(f"../../..{device_path(plugged)}")

    def remove(self, plugged: Plugged) -> None:
        self._link(plugged).unlink()
        (self._root / node(plugged).lstrip("/")).unlink()
        self.socket(plugged).unlink()
        shutil.rmtree(self._root / "sys" / device_path(plugged).lstrip("/"))

    def _link(self, plugged: Plugged) -> Path:
        return self._root / "sys/bus/usb/devices" / _name(plugged)

    def _node(self, plugged: Plugged) -> None:
        path = self._root / node(plugged).lstrip("/")
        path.parent.mkdir(exist_ok=True)
        if plugged.permitted:
            path.write_bytes(_descriptors(plugged))
        else:
            path.symlink_to(UNREADABLE)


def node(plugged: Plugged) -> str:
    """The device's file in /dev."""
    return f"/dev/bus/usb/{plugged.bus_number:03}/{plugged.address:03}"


def device_path(plugged: Plugged) -> str:
    """Below /sys."""
    return f"/{_CONTROLLER}/usb{plugged.bus_number}/{_name(plugged)}"


def properties(plugged: Plugged) -> dict[str, str]:
    """What the kernel says of it in each event."""
    return {
        "MAJOR": str(_MAJOR),
        "MINOR": str((plugged.bus_number - 1) * 128 + plugged.address - 1),
        "DEVNAME": node(plugged).removeprefix("/dev/"),
        "DEVTYPE": "usb_device",
        "DRIVER": "usb",
        "BUSNUM": f"{plugged.bus_number:03}",
        "DEVNUM": f"{plugged.address:03}",
    }


def _name(plugged: Plugged) -> str:
    return f"{plugged.bus_number}-{plugged.port}"


def _descriptors(plugged: Plugged) -> bytes:
    identity, speed = plugged.function.identity, plugged.speed
    return descriptors.device(identity, speed) + descriptors.configuration(identity, speed)


def _attributes(plugged: Plugged) -> dict[str, bytes]:
    identity = plugged.function.identity
    texts = {
        "busnum": plugged.bus_number,
        "devnum": plugged.address,
        "devpath": plugged.port,
        "speed": plugged.speed.value,
        "bConfigurationValue": 1,
        "bNumConfigurations": 1,
        "bDeviceClass": "ef",
        "idVendor": f"{identity.vendor_id:04x}",
        "idProduct": f"{identity.product_id:04x}",
        "manufacturer": identity.vendor,
        "product": identity.model,
        "serial": identity.serial,
        "uevent": "\n".join(f"{key}={value}" for key, value in properties(plugged).items()),
    }
    found = {name: f"{value}\n".encode() for name, value in texts.items()}
    return {**found, "descriptors": _descriptors(plugged)}
