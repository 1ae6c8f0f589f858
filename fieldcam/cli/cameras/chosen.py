"""Which of the attached cameras a command is about."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from fieldcam.errors import BadInput, CameraUnplugged

if TYPE_CHECKING:
    from fieldcam.camera.usb3vision.devices import AttachedCamera

CHECK_CABLE = "Check its cable at both ends; `fieldcam camera list` shows what is there."


def add_serial(options: argparse._ActionsContainer) -> None:
    options.add_argument("--serial", metavar="S", help="the camera's serial number or GUID")


def choose_cameras(serial: str | None) -> tuple[AttachedCamera, ...]:
    """Those of this serial number or GUID, or all.

    Raises CameraUnplugged where there is none of this number, or CameraForbidden where
    it may be one that does not let itself be asked.
    """
    from fieldcam.camera.usb3vision.devices import attached_cameras

    cameras = attached_cameras()
    if serial is None:
        return cameras
    found = tuple(c for c in cameras if serial in (c.names.serial, c.names.guid))
    if not found:
        for camera in cameras:
            if camera.trouble is not None:
                raise camera.trouble
        raise CameraUnplugged(f"No camera {serial} is attached.", CHECK_CABLE)
    return found


def choose_camera(serial: str | None) -> AttachedCamera:
    """The only one; raises BadInput where there are several."""
    cameras = choose_cameras(serial)
    if not cameras:
        raise CameraUnplugged("No USB3 Vision camera is attached.", CHECK_CABLE)
    if len(cameras) > 1:
        serials = ", ".join(camera.names.serial or camera.port for camera in cameras)
        raise BadInput(f"Several cameras are attached: {serials}.", "Name one with --serial.")
    return cameras[0]
