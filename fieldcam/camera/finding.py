"""The camera of this machine, whichever driver it needs."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

from fieldcam.camera.head.device import UsbStereoHead
from fieldcam.camera.head.opening import OpenHead, Usb, choose, open_head
from fieldcam.camera.head.settings import HeadSettings, load_settings
from fieldcam.camera.port import FlashStereoDevice
from fieldcam.camera.usb3vision.description import cache_folder

MACHINE = Usb()


class HeadFinder:
    """Opens the head of a data folder; after it was unplugged, the same one again."""

    def __init__(self, data: Path | None, usb: Usb = MACHINE) -> None:
        self._data, self._usb = data, usb
        self._serials: tuple[str, str] | None = None

    def open(self) -> UsbStereoHead:
        """Set up by `camera.toml`, which is read anew each time.

        Raises CameraUnplugged where there is none, CameraSettingsInvalid, and whatever
        else keeps the camera from being used.
        """
        return UsbStereoHead(partial(self._open_cameras, load_settings(self._data)))

    def _open_cameras(self, settings: HeadSettings) -> OpenHead:
        """Also after a rest, in which another head may have been plugged in."""
        if self._serials is not None and settings.left is None:
            left, right = self._serials
            alone = right == left or settings.has_one_camera
            settings = replace(settings, left=left, right=None if alone else right)
        head = open_head(settings, cache_folder(), self._usb)
        self._serials = head.serials
        return head


def look_for_camera(data: Path | None, usb: Usb = MACHINE) -> None:
    """Opens nothing; raises as `HeadFinder.open` does where no eye, or not every one, is there."""
    choose(load_settings(data), usb.cameras())


def open_camera(data: Path | None = None) -> FlashStereoDevice:
    """The head that is plugged in; raises as `HeadFinder.open` does."""
    return HeadFinder(data).open()
