"""Which attached cameras are the eyes; opens them and sets them up."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from fieldcam.camera.head.adjusting import has
from fieldcam.camera.head.assembly import WORDS, Assembly, assembly, layout_doubt, told_by_image
from fieldcam.camera.head.eyes import EyeCamera
from fieldcam.camera.head.plan import HeadPart, setting_up
from fieldcam.camera.head.settings import Carrying, HeadSettings
from fieldcam.camera.usb3vision.devices import (
    AttachedCamera,
    OpenCamera,
    attached_cameras,
    open_attached,
)
from fieldcam.camera.usb3vision.pairing import Eye
from fieldcam.camera.usb3vision.transport import LinkSpeed
from fieldcam.errors import CameraSettingsInvalid, CameraUnplugged, CameraUnsupported

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Usb:
    """The USB ports of this machine."""

    cameras: Callable[[], Sequence[AttachedCamera]] = attached_cameras
    open: Callable[[AttachedCamera], OpenCamera] = open_attached


@dataclass(frozen=True, slots=True)
class OpenHead:
    """The cameras of one head, set up and standing still."""

    settings: HeadSettings
    eyes: tuple[EyeCamera, ...]
    """Left before right; one where it carries both."""
    leader: EyeCamera
    """The camera that is triggered, and has the flash."""
    assembly: Assembly
    notes: tuple[str, ...]
    """A sentence for each thing that is not as it should be."""

    @property
    def serials(self) -> tuple[str, str]:
        return self.eyes[0].serial, self.eyes[-1].serial

    def start(self) -> None:
        """Followers first, so that none misses the leader's first pulse."""
        for eye in sorted(self.eyes, key=lambda eye: eye is self.leader):
            eye.start()

    def close(self) -> None:
        for eye in self.eyes:
            eye.close()


def open_head(settings: HeadSettings, cache: Path, usb: Usb) -> OpenHead:
    """Raises CameraUnplugged where an eye is missing, and whatever keeps it from being used."""
    chosen, notes = choose(settings, usb.cameras())
    with ExitStack() as stack:
        eyes = []
        for camera in chosen:
            eyes.append(_opened(usb.open(camera), cache, settings.feature_file))
            stack.callback(eyes[-1].close)
        leader = _leader(settings, eyes)
        for eye in eyes:
            adjusted = eye.set_up(setting_up(settings, _part(eye, leader, len(eyes))))
            log.info("camera %s was set up: %s", eye.serial, adjusted.values)
            found = [eye.note, *adjusted.lacks] if eye.note else adjusted.lacks
            notes += [f"{sentence} ({eye.serial})" for sentence in found]
            notes += _slow(eye)
        carrying = _carrying(settings, eyes)
        notes += _doubts(carrying, eyes)
        stack.pop_all()
    return OpenHead(settings, tuple(eyes), leader, assembly(carrying), tuple(notes))


def choose(
    settings: HeadSettings, attached: Sequence[AttachedCamera]
) -> tuple[list[AttachedCamera], list[str]]:
    """The head's cameras, left before right, and what is to be told about the choice."""
    if not attached:
        raise CameraUnplugged("No camera is plugged in.", "Check its cable at both ends.")
    for camera in attached:
        if camera.trouble is not None:
            raise camera.trouble
    if settings.left is not None:
        return _chosen_by_name(settings, settings.left, attached)
    by_serial = sorted(attached, key=lambda camera: camera.names.serial)
    if len(by_serial) == 1 or settings.has_one_camera:
        return by_serial[:1], []
    left, right = (camera.names.serial for camera in by_serial[:2])
    sentence = (
        f"{left} is taken for the left camera, {right} for the right one: camera.toml names none."
    )
    return by_serial[:2], [sentence]


def _chosen_by_name(
    settings: HeadSettings, left: str, attached: Sequence[AttachedCamera]
) -> tuple[list[AttachedCamera], list[str]]:
    """Where only `left` is named and one other camera is there, that is the right one."""
    eyes, notes = [_named(attached, Eye.LEFT, left)], []
    others = [camera for camera in attached if camera.names.serial != left]
    if settings.right is not None:
        eyes.append(_named(attached, Eye.RIGHT, settings.right))
    elif len(others) == 1 and not settings.has_one_camera:
        eyes += others
        serial = others[0].names.serial
        notes.append(f"{serial} is taken for the right camera: camera.toml names only the left.")
    return eyes, notes


def _named(attached: Sequence[AttachedCamera], eye: Eye, serial: str) -> AttachedCamera:
    for camera in attached:
        if camera.names.serial == serial:
            return camera
    others = " and ".join(camera.names.serial for camera in attached)
    raise CameraUnplugged(
        f"The {eye} camera {serial} is not plugged in, only {others}.",
        f"Check its cable, or `{eye}` in camera.toml.",
    )


def _opened(camera: OpenCamera, cache: Path, feature_file: Path | None) -> EyeCamera:
    try:
        return EyeCamera(camera, cache, feature_file)
    except BaseException:
        camera.close()
        raise


def _carrying(settings: HeadSettings, eyes: Sequence[EyeCamera]) -> Carrying:
    """Of cameras that are set up: another program may have cut their pictures."""
    if len(eyes) > 1:
        return Carrying.TWO_DEVICES
    looks_like = told_by_image(*_image(eyes[0]))
    alone = looks_like is Carrying.TWO_DEVICES
    if settings.layout is Carrying.TWO_DEVICES:
        raise CameraUnplugged(
            f"Only one of the head's two cameras is plugged in: {eyes[0].serial}.",
            "Check the other one's cable."
            if alone
            else f"Its pictures look like {WORDS[looks_like]}: check `layout` in camera.toml.",
        )
    if settings.layout is None and alone:
        raise CameraUnsupported(
            "Only one camera answers, and its picture is that of one eye.",
            "Check the other camera's cable; a head with one cable needs `layout` in camera.toml.",
        )
    return settings.layout or looks_like


def _doubts(carrying: Carrying, eyes: Sequence[EyeCamera]) -> list[str]:
    """About the layout; each once, since both eyes of a head are mostly alike."""
    found = (layout_doubt(carrying, *_image(eye)) for eye in eyes)
    return list(dict.fromkeys(doubt for doubt in found if doubt is not None))


def _image(eye: EyeCamera) -> tuple[tuple[int, int], int]:
    """Width and height in pixels, and how many image sources there are."""
    features = eye.features
    size_px = features.integer("Width").value, features.integer("Height").value
    return size_px, features.integer("SourceCount").value if has(features, "SourceCount") else 1


def _leader(settings: HeadSettings, eyes: Sequence[EyeCamera]) -> EyeCamera:
    """Not by the eye, so that the flash stays where it is when left and right are swapped."""
    if settings.leader is None:
        return min(eyes, key=lambda eye: eye.serial)
    for eye in eyes:
        if eye.serial == settings.leader:
            return eye
    raise CameraSettingsInvalid(
        f"camera.toml names {settings.leader} as the leader, which is no camera of this head.",
        f"Its cameras are {' and '.join(eye.serial for eye in eyes)}.",
    )


def _part(eye: EyeCamera, leader: EyeCamera, cameras: int) -> HeadPart:
    if cameras == 1:
        return HeadPart.ALONE
    return HeadPart.LEADER if eye is leader else HeadPart.FOLLOWER


def _slow(eye: EyeCamera) -> list[str]:
    """A triggered picture comes over USB 2 as well, only later."""
    if eye.speed is LinkSpeed.UNKNOWN or eye.speed.is_usb3:
        return []
    sentence = f"{eye.serial} is in a USB 2 port or on a USB 2 cable: each picture takes longer."
    return [sentence]
