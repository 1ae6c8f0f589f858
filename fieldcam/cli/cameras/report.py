"""What `fieldcam camera probe` found, as lines and as JSON."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fieldcam import __version__
from fieldcam.cli.cameras.features import feature_lines
from fieldcam.cli.cameras.listing import camera_entry, camera_lines
from fieldcam.cli.console import printable, screen_width, table
from fieldcam.words import number_of

if TYPE_CHECKING:
    from fieldcam.camera.usb3vision.manifest import ManifestEntry
    from fieldcam.camera.usb3vision.probing import CameraReport
    from fieldcam.camera.usb3vision.survey import Survey, UsbDevice


@dataclass(frozen=True, slots=True)
class Findings:
    """One probe of a machine."""

    survey: Survey
    reports: tuple[CameraReport, ...]


def versions() -> dict[str, str]:
    """Of whatever takes part in a transfer."""
    from fieldcam.camera.usb3vision.survey import libusb_version

    return {
        "fieldcam": __version__,
        "python": platform.python_version(),
        "kernel": f"{platform.system()} {platform.release()} {platform.machine()}",
        "libusb": libusb_version(),
    }


def document(findings: Findings) -> dict[str, Any]:
    """All of it as JSON; bytes are in hexadecimal."""
    return {
        "versions": versions(),
        "devices": [_device(device) for device in findings.survey.candidates],
        "left_out": findings.survey.left_out,
        "cameras": [_camera(report) for report in findings.reports],
    }


def lines(findings: Findings) -> Iterator[str]:
    """All of it for reading."""
    for device in findings.survey.candidates:
        yield from device_lines(device)
        yield ""
    yield _summary(findings.survey)
    for report in findings.reports:
        yield ""
        yield from camera_lines(report.camera)
        yield from report_lines(report)


def device_lines(device: UsbDevice) -> Iterator[str]:
    """A USB device and its descriptors."""
    from fieldcam.camera.usb3vision.descriptor_text import describe_descriptors

    names = printable(" ".join(filter(None, device.names))) or "no names"
    yield f"USB {device.port} (bus {device.bus}, address {device.address}): {names}"
    for line in describe_descriptors(device.descriptors + device.object_store):
        yield f"  {line}"
    if device.trouble is not None:
        yield f"  trouble: {device.trouble}"


def report_lines(report: CameraReport) -> Iterator[str]:
    """What a USB3 Vision camera tells about itself, as far as it does."""
    known = str(report.camera.trouble)
    yield from (f"  problem {printable(each)}" for each in report.problems if each != known)
    if report.registers:
        yield from ("", *register_lines(report))
    if report.manifest:
        yield from ("", *map(_manifest_line, report.manifest))
    if report.features:
        yield from ("", *feature_lines(report.features, width=screen_width()))


def register_lines(report: CameraReport) -> list[str]:
    """A table of the bootstrap registers."""
    rows = [
        [each.block, f"{each.address:x}", each.name, printable(each.text)]
        for each in report.registers
    ]
    return table([["block", "address", "register", "content"], *rows], "<><<")


def _summary(survey: Survey) -> str:
    found = number_of(len(survey.candidates), "USB device")
    return f"{found} could be a camera; {survey.left_out} others cannot (hubs, keyboards, disks)."


def _manifest_line(entry: ManifestEntry) -> str:
    version = ".".join(map(str, entry.file_version))
    schema = ".".join(map(str, entry.schema_version))
    return (
        f"Description file {version}, GenApi {schema}, format {entry.file_format}, "
        f"{entry.length} bytes at {entry.address:x}"
    )


def _device(device: UsbDevice) -> dict[str, Any]:
    vendor, product, serial = device.names
    return {
        "usb_id": f"{device.usb_id[0]:04x}:{device.usb_id[1]:04x}",
        "vendor": vendor,
        "product": product,
        "serial": serial,
        "port": device.port,
        "bus": device.bus,
        "address": device.address,
        "speed": device.speed.name.lower(),
        "descriptors": device.descriptors.hex(),
        "object_store": device.object_store.hex(),
        "trouble": None if device.trouble is None else device.trouble.message,
    }


def _camera(report: CameraReport) -> dict[str, Any]:
    return camera_entry(report.camera) | {
        "registers": [
            {
                "block": each.block,
                "name": each.name,
                "address": each.address,
                "content": each.content.hex(),
                "problem": each.problem or None,
            }
            for each in report.registers
        ],
        "manifest": [_manifest(entry) for entry in report.manifest],
        "features": report.features,
        "problems": report.problems,
    }


def _manifest(entry: ManifestEntry) -> dict[str, Any]:
    return {
        "file_version": list(entry.file_version),
        "schema_version": list(entry.schema_version),
        "format": entry.file_format,
        "address": entry.address,
        "length": entry.length,
        "sha1": None if entry.sha1 is None else entry.sha1.hex(),
    }
