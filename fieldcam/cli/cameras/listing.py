"""An attached camera as lines and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from fieldcam.cli.console import printable

if TYPE_CHECKING:
    from fieldcam.camera.usb3vision.devices import AttachedCamera

SPEEDS = (
    "not known",
    "USB 1, 1.5 Mbit/s",
    "USB 1, 12 Mbit/s",
    "USB 2, 480 Mbit/s",
    "USB 3, 5 Gbit/s",
    "USB 3, 10 Gbit/s",
)
"""By LinkSpeed."""
SLOW = "a pair takes about 0.1 s to arrive; use a USB 3 port and cable"


def camera_entry(camera: AttachedCamera) -> dict[str, Any]:
    """One camera as JSON."""
    from fieldcam.camera.usb3vision.holders import holder_of

    names, trouble = camera.names, camera.trouble
    return {
        "vendor": names.vendor,
        "model": names.model,
        "serial": names.serial,
        "guid": names.guid,
        "user_name": names.user_name,
        "usb_id": f"{camera.usb_id[0]:04x}:{camera.usb_id[1]:04x}",
        "port": camera.port,
        "bus": camera.bus,
        "address": camera.address,
        "speed": camera.speed.name.lower(),
        "usb3": camera.speed.is_usb3,
        "power_ma": camera.power_ma,
        "held_by": holder_of(camera.bus, camera.address),
        "trouble": None if trouble is None else {"text": trouble.message, "hint": trouble.hint},
    }


def camera_lines(camera: AttachedCamera) -> Iterator[str]:
    """The same for reading."""
    entry = camera_entry(camera)
    title = " ".join(filter(None, (entry["vendor"], entry["model"], entry["serial"])))
    yield printable(title) or f"A camera that does not tell its name, {entry['usb_id']}"
    facts = {
        "GUID": entry["guid"],
        "name": entry["user_name"],
        "port": f"{camera.port} (bus {camera.bus}, address {camera.address})",
        "speed": SPEEDS[camera.speed],
        "power": f"takes up to {camera.power_ma} mA from the port",
        "in use": entry["held_by"] and f"by {entry['held_by']}",
    }
    yield from (f"  {name:<8}{printable(text)}" for name, text in facts.items() if text)
    if not camera.speed.is_usb3:
        yield f"  slow    {SLOW}"
    if camera.trouble is not None:
        yield f"  trouble {camera.trouble}"
