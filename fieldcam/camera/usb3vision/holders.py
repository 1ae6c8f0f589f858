"""Who holds a USB device that cannot be claimed, as far as Linux tells."""

from __future__ import annotations

from pathlib import Path

_ROOT = Path("/")


def holder_of(bus: int, address: int, root: Path = _ROOT) -> str | None:
    """Name of a program, or of a kernel driver, that has this device open; None where
    nobody can be named. Other users' programs are seen only by root.
    """
    node = f"/dev/bus/usb/{bus:03d}/{address:03d}"
    return _program(node, root / "proc") or _driver(bus, address, root / "sys/bus/usb/devices")


def _program(node: str, proc: Path) -> str | None:
    for process in proc.glob("[0-9]*"):
        try:
            links = [str(link.readlink()) for link in (process / "fd").iterdir()]
            if node in links and process.name != (proc / "self").readlink().name:
                return f"{(process / 'comm').read_text().strip()} (process {process.name})"
        except OSError:
            continue
    return None


def _driver(bus: int, address: int, devices: Path) -> str | None:
    for device in devices.glob(f"{bus}-*"):
        try:
            if int((device / "devnum").read_text()) != address:
                continue
        except (OSError, ValueError):
            continue
        for driver in sorted(device.glob(f"{device.name}:*/driver")):
            if (name := driver.resolve().name) != "usbfs":
                return f"the kernel driver {name}"
    return None
