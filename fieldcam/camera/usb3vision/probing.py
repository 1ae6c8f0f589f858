"""Everything that one camera tells about itself, as far as it tells it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from usb.backend import IBackend

from fieldcam.camera.genapi import Entry, NodeMap, plain_xml, present_entries
from fieldcam.camera.usb3vision.bootstrap import channel_limits, read_abrm, read_sbrm
from fieldcam.camera.usb3vision.channel import ControlChannel
from fieldcam.camera.usb3vision.description import describe, fetch_description
from fieldcam.camera.usb3vision.devices import AttachedCamera, claim_attached
from fieldcam.camera.usb3vision.manifest import ManifestEntry, newest_first, read_manifest
from fieldcam.camera.usb3vision.register_blocks import RegisterContent, read_blocks
from fieldcam.errors import (
    CameraRefused,
    CameraUnsupported,
    DeviceError,
    FeatureFileInvalid,
)


@dataclass(slots=True)
class CameraReport:
    """Filled from top to bottom, so that a camera that goes in the middle leaves the rest empty."""

    camera: AttachedCamera
    registers: list[RegisterContent] = field(default_factory=list)
    manifest: tuple[ManifestEntry, ...] = ()
    description: bytes = b""
    """The newest GenICam XML, be it proper or not; zipped where it cannot be unzipped."""
    features: list[Entry] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    """What could not be read and why, each in a sentence."""


def probe_camera(
    camera: AttachedCamera, cache: Path, backend: IBackend | None = None
) -> CameraReport:
    """Claims it for the time being and changes nothing; what goes wrong is in the report."""
    report = CameraReport(camera)
    try:
        with closing(claim_attached(camera, backend)) as link:
            _ask(ControlChannel(link.control_out, link.control_in), cache, report)
    except DeviceError as error:
        report.problems.append(str(error))
    return report


def _ask(channel: ControlChannel, cache: Path, report: CameraReport) -> None:
    for register in read_blocks(channel):
        report.registers.append(register)
    with _noted(report):
        abrm = read_abrm(channel)
        channel.limits = channel_limits(abrm, read_sbrm(channel, abrm))
        report.manifest = read_manifest(channel, abrm)
        entries = newest_first(report.manifest)
        with suppress(CameraUnsupported, CameraRefused, FeatureFileInvalid):
            # Unzipped where that can be done, else as it is: somebody has to look into it.
            report.description = fetch_description(channel, entries[0], cache)
            report.description = plain_xml(report.description)
        found = describe(channel, entries, cache)
        report.problems += [found.note] if found.note else []
        features = NodeMap(found.document, channel)
        for entry in present_entries(features):
            report.features.append(entry)


@contextmanager
def _noted(report: CameraReport) -> Iterator[None]:
    try:
        yield
    except (CameraRefused, CameraUnsupported, FeatureFileInvalid) as error:
        report.problems.append(str(error))
