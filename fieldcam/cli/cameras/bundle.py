"""The zip of `fieldcam camera probe --out`: what somebody needs who writes a driver."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator

from fieldcam.cli.cameras.features import feature_lines
from fieldcam.cli.cameras.report import (
    Findings,
    device_lines,
    document,
    register_lines,
    versions,
)

README = """\
What is in this bundle
----------------------
versions.txt        of fieldcam, Python, the kernel and libusb
probe.json          everything below in one document
usb/PORT.bin        a device's descriptors as bytes: device, configurations; then the
                    binary object store, where it gives one
usb/PORT.txt        the same for reading
cameras/PORT/       of each USB3 Vision camera: its registers, its GenICam file
                    (description.xml), its features with their present values, and
                    what it refused (problems.txt)

PORT is the socket as Linux names it: 2-1.3 is socket 3 of a hub in socket 1 of bus 2.

What it tells about you
-----------------------
Names, serial numbers and ids of the USB devices that could be a camera; a phone or a
webcam may be among them. A camera's user-defined name, where somebody gave it one. The
versions of your kernel and libraries. No pictures, no files, nothing of hubs,
keyboards, disks and the like.

What it cannot tell: how the camera is triggered
------------------------------------------------
If the camera is not a USB3 Vision camera, a record of the bus while its own program
takes one picture is needed too. On Linux:

1. Install tshark (Debian, Ubuntu: sudo apt install tshark), and run: sudo modprobe usbmon
2. A record holds ALL that goes over a bus, keystrokes of a USB keyboard too. Unplug
   everything else from the camera's bus, type nothing secret, and end it by Ctrl+C.
3. Find the bus of the camera: BUS is the number before the dash in PORT.
4. How it starts. Unplug the camera, then:
       sudo tshark -i usbmonBUS -w start.pcapng
   Plug it in, wait 5 seconds, open its own program, wait for the first picture, end.
5. One trigger. With the program open and nothing moving:
       sudo tshark -i usbmonBUS -w trigger.pcapng
   Wait 5 seconds, take ONE picture, wait 5 seconds, end.
6. The same again with another exposure time, into exposure.pcapng, and with the head's
   own button instead of the program, into button.pcapng.

On Windows, where the camera's own program may only run: install Wireshark with USBPcap,
choose the USBPcap interface that the camera is on, and record the same four things.

Send with the records: this bundle; which exposure times were set; the pictures that the
program saved. Long transfers are cut in a record. That does no harm: their lengths,
their order and their beginnings are what is needed.
"""


def bundle(findings: Findings) -> bytes:
    """The zip."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in _files(findings):
            archive.writestr(name, content)
    return target.getvalue()


def _files(findings: Findings) -> Iterator[tuple[str, str | bytes]]:
    yield "README.txt", README
    yield "versions.txt", _text(f"{name} {version}" for name, version in versions().items())
    yield "probe.json", json.dumps(document(findings), indent=2, allow_nan=False)
    for device in findings.survey.candidates:
        yield f"usb/{device.port}.bin", device.descriptors + device.object_store
        yield f"usb/{device.port}.txt", _text(device_lines(device))
    for report in findings.reports:
        folder = f"cameras/{report.camera.port}"
        yield f"{folder}/registers.txt", _text(register_lines(report))
        yield f"{folder}/features.txt", _text(feature_lines(report.features))
        yield f"{folder}/problems.txt", _text(report.problems)
        if report.description:
            yield f"{folder}/description.xml", report.description


def _text(lines: Iterator[str] | list[str]) -> str:
    return "".join(f"{line}\n" for line in lines)
