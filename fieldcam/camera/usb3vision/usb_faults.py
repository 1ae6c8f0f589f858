"""libusb's error numbers as errors that say what the operator can do.

Which number stands for what was measured through pyusb 1.3.1 and libusb 1.0.26.
"""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager

import usb.core

from fieldcam.camera.usb3vision.transport import (
    EndpointStalled,
    LinkFault,
    TransferOverflow,
    TransferTimeout,
)
from fieldcam.errors import (
    CameraBusy,
    CameraForbidden,
    CameraUnplugged,
    CameraUnsupported,
    DeviceError,
    UsbLibraryMissing,
    UsbMemoryShort,
)

UDEV_RULE_PATH = "/etc/udev/rules.d/60-fieldcam-camera.rules"
UDEV_RULE = (
    'ACTION!="remove", SUBSYSTEM=="usb", ENV{DEVTYPE}=="usb_device", '
    'ENV{ID_USB_INTERFACES}=="*:ef0500:*", MODE="0664", GROUP="plugdev", TAG+="uaccess", '
    'ATTR{power/control}="on"'
)
"""The same line as in systemd/60-fieldcam-camera.rules."""

_USBFS_MEMORY = "/sys/module/usbcore/parameters/usbfs_memory_mb"

_CAUSES: dict[int, tuple[type[DeviceError], str, str]] = {
    errno.ENODEV: (
        CameraUnplugged,
        "The camera is gone.",
        "Check its cable at both ends; if it went at a flash, its power supply.",
    ),
    errno.EACCES: (
        CameraForbidden,
        "You may not use the camera on this machine.",
        f"Put this line into {UDEV_RULE_PATH}: {UDEV_RULE} - then run `sudo udevadm control "
        "--reload` and plug the camera in again.",
    ),
    errno.EBUSY: (CameraBusy, "Another program holds the camera.", "Close it and try again."),
    errno.ENOMEM: (
        UsbMemoryShort,
        "The kernel grants no more memory for USB transfers.",
        f"Run: echo 256 | sudo tee {_USBFS_MEMORY}",
    ),
    errno.ETIMEDOUT: (TransferTimeout, "The camera sent nothing in time.", ""),
    errno.EPIPE: (EndpointStalled, "The camera halted a transfer.", "Take the picture again."),
    errno.EOVERFLOW: (
        TransferOverflow,
        "The camera sent more than was asked for.",
        "Take the picture again.",
    ),
}
_LINK = (LinkFault, "The USB link reported an error.", "Use a shorter cable or another port.")


def device_error(error: usb.core.USBError) -> DeviceError:
    """The leaf that fits a failed libusb call."""
    leaf, message, hint = _CAUSES.get(error.errno or 0, _LINK)
    return leaf(message, hint)


@contextmanager
def usb_faults() -> Iterator[None]:
    """Turns every pyusb error inside into a DeviceError."""
    try:
        yield
    except usb.core.NoBackendError as error:
        raise UsbLibraryMissing(
            "libusb is not installed, so no USB camera can be used.",
            "Install it (on Debian and Ubuntu: sudo apt install libusb-1.0-0).",
        ) from error
    except usb.core.USBError as error:
        raise device_error(error) from error
    except NotImplementedError as error:
        raise CameraUnsupported("This system's USB library cannot drive the camera.") from error
