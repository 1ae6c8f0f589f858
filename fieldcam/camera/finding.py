"""The camera of this machine, whichever driver it needs."""

from __future__ import annotations

from fieldcam.camera.port import FlashStereoDevice
from fieldcam.errors import CameraUnplugged


def open_camera() -> FlashStereoDevice:
    """The first camera that answers; raises CameraUnplugged where there is none.

    Each driver is tried here; there is none yet.
    """
    raise CameraUnplugged(
        "No camera: this version drives none.",
        "`fieldcam import` brings in pictures.",
    )
