"""What can go wrong, sorted by what the operator can do about it.

Every error carries one sentence that says what happened (`message`) and one
that says what to do now (`hint`). The command line prints both and leaves with
the error's `exit_code`; nothing else in the package calls `sys.exit`, but for the
launcher, which hands on the status of its child.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Self


class ExitCode(IntEnum):
    """A command's exit status; `meaning` says it in a sentence."""

    meaning: str

    def __new__(cls, status: int, meaning: str) -> Self:
        """An int, as `sys.exit` wants it."""
        code = int.__new__(cls, status)
        code._value_, code.meaning = status, meaning
        return code

    OK = 0, "The asked-for result was printed, whatever the verdict."
    BAD_INPUT = 2, "The command was called wrongly, or a file given to it cannot be used."
    DEVICE = 3, "The camera, or another device, did not do what it was asked to."
    STORAGE = 4, "The data folder cannot be read or written."
    REMOTE = 5, "The other end of a transfer cannot be reached or refused."
    DEFECT = 70, "A defect of fieldcam itself."


OF_SIGNALS = 128
"""Shells expect this, and the signal's number more, of a program that a signal ended."""


class FieldcamError(Exception):
    """Base of every error that fieldcam raises on purpose."""

    exit_code: int = ExitCode.BAD_INPUT

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message} {self.hint}".rstrip()


class BadInput(FieldcamError):
    """A value, file or folder given by the operator cannot be used as it is."""


class ImageUnreadable(BadInput):
    """An image is missing, empty, truncated, or not 8-bit."""


class PairMismatch(BadInput):
    """Left and right do not belong together, or not to this calibration."""


class CalibrationInvalid(BadInput):
    """A calibration file cannot be read, or describes an impossible camera."""


class ReadingInvalid(BadInput):
    """A stored reading cannot be decoded, or was written by a newer version."""


class ModelMissing(BadInput):
    """A network's file is missing, or is not the file that the manifest names."""


class FeatureFileInvalid(BadInput):
    """A camera's description of its features (GenICam XML) cannot be used."""


class CameraSettingsInvalid(BadInput):
    """The file that describes the camera's set-up cannot be used."""


class ExtraMissing(BadInput):
    """An optional part of fieldcam is not installed."""


class DeviceError(FieldcamError):
    """The camera did not do what it was asked to."""

    exit_code = ExitCode.DEVICE


class CameraUnplugged(DeviceError):
    """No camera answers."""


class CameraPowerLost(CameraUnplugged):
    """The camera dropped off the bus just when its flash fired."""


class CameraBusy(DeviceError):
    """Another program, or a driver of the system, holds the camera."""


class CameraForbidden(DeviceError):
    """The operator may not use the camera: a udev rule is missing."""


class CameraSilent(DeviceError):
    """The camera is plugged in, but does not answer; plugging it in anew may help."""


class CameraRefused(DeviceError):
    """The camera answered that it will not do what it was asked to."""

    def __init__(self, message: str, hint: str = "", why: str = "") -> None:
        """`why` is the camera's own reason; empty where it gave none."""
        super().__init__(message, hint)
        self.why = why


class CameraUnsupported(DeviceError):
    """The camera says something about itself or its images that fieldcam cannot use."""


class UsbMemoryShort(DeviceError):
    """The kernel grants too little memory for USB transfers."""


class UsbLibraryMissing(DeviceError):
    """libusb, which pyusb needs, is not installed."""


class CaptureTimeout(DeviceError):
    """The camera gave no pair before the deadline."""


class FrameIncomplete(DeviceError):
    """A picture arrived damaged or in part and was dropped; taking it again may help."""


class FlashMissing(DeviceError):
    """A picture came and shows nothing but the light of the day: the flash did not fire."""


class FeatureMissing(DeviceError):
    """The camera has no such feature, or one of another kind."""


class FeatureRefused(DeviceError):
    """A feature cannot be read, set or run as asked, or not now."""


class StorageError(FieldcamError):
    """The data folder cannot be read or written."""

    exit_code = ExitCode.STORAGE


class StorageFull(StorageError):
    """There is no room left to save a capture."""


class OutputLost(StorageError):
    """What a command printed could not be written where it was sent."""


class StorageBusy(StorageError):
    """Another program keeps the database locked."""


class StorageDamaged(StorageError):
    """The database file has damaged pages."""


class RowsLost(StorageError):
    """Pictures lie in a data folder whose database does not know them."""


class ReadingDamaged(StorageError):
    """A stored reading is not what was written; its picture can be read again."""

    def __init__(self, message: str, hint: str = "", reading: str = "") -> None:
        """`reading` is the id of its row; empty where it came from elsewhere."""
        super().__init__(message, hint)
        self.reading = reading


class DatabaseTooNew(StorageError):
    """The database was written by a newer version of fieldcam."""


class AnalysisFailed(FieldcamError):
    """A saved pair could not be analysed, through no fault of its own; the picture is kept."""

    exit_code = ExitCode.DEFECT


class AnalysisTimeout(AnalysisFailed):
    """The analysis did not answer before the deadline."""


class AnalysisOff(AnalysisFailed):
    """The analysis was closed, or ended too often to be started again by itself."""


class ScreenLost(FieldcamError):
    """The screens were killed by somebody else, or by the system."""

    def __init__(self, message: str, hint: str = "", number: int = 9) -> None:
        """`number` is the signal's; that of SIGKILL where it is not known."""
        super().__init__(message, hint)
        self.exit_code = OF_SIGNALS + number


class ScreenCrashed(FieldcamError):
    """The screens ended by a fault of their own, below Python."""

    exit_code = ExitCode.DEFECT


class Stopped(KeyboardInterrupt):
    """A signal ended the program, which had time to put everything in order."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number
