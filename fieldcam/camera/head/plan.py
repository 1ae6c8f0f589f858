"""Which features a head's cameras are set up with, by their SFNC names. Pure."""

from __future__ import annotations

from enum import Enum, auto

from fieldcam.camera.head.adjusting import Adjustment, Need
from fieldcam.camera.head.settings import HeadSettings

OFF = "Off"
EXPOSURE_ACTIVE = "ExposureActive"


class Part(Enum):
    """What one camera does in its head."""

    ALONE = auto()
    LEADER = auto()
    """Is triggered, fires the flash, and triggers the follower."""
    FOLLOWER = auto()


def setting_up(settings: HeadSettings, part: Part) -> list[Adjustment]:
    """All that stays the same while the camera is open, in the order to be set."""
    return [
        Adjustment("AcquisitionMode", "Continuous", need=Need.IF_THERE),
        *_picture(settings),
        *_exposure(settings),
        *_trigger(settings, part),
        *_lines(settings, part),
        *([] if part is Part.FOLLOWER else _signals(settings)),
    ]


def for_flash(settings: HeadSettings) -> list[Adjustment]:
    """Of the camera that has the flash: every picture is lit."""
    adjustments = [Adjustment("ExposureTime", settings.exposure_us)]
    if settings.strobe_line:
        at = ("LineSelector", settings.strobe_line)
        adjustments.append(Adjustment("LineSource", settings.strobe_source, at))
    return adjustments


def for_aiming(settings: HeadSettings, exposure_us: float) -> list[Adjustment]:
    """Of the camera that has the flash: no picture is lit.

    Without a strobe line the flash cannot be kept from firing.
    """
    at = ("LineSelector", settings.strobe_line)
    dark = Adjustment("LineSource", OFF, at, Need.MUST)
    return [dark, Adjustment("ExposureTime", exposure_us)]


def _picture(settings: HeadSettings) -> list[Adjustment]:
    found = []
    if settings.pixel_format is not None:
        found.append(Adjustment("PixelFormat", settings.pixel_format))
    if settings.throughput_bytes_per_s is not None:
        found.append(Adjustment("DeviceLinkThroughputLimitMode", True, need=Need.IF_THERE))
        found.append(Adjustment("DeviceLinkThroughputLimit", settings.throughput_bytes_per_s))
    return found


def _exposure(settings: HeadSettings) -> list[Adjustment]:
    """Whatever is automatic makes a stereo pair's halves differ, and sizes with them."""
    all_gains, ratio = ("GainSelector", "All"), "BalanceRatio"
    found = [
        Adjustment("ExposureMode", "Timed", need=Need.IF_THERE),
        Adjustment("ExposureAuto", OFF, need=Need.IF_THERE),
        Adjustment("GainAuto", OFF, all_gains, Need.IF_THERE),
        Adjustment("BalanceWhiteAuto", OFF, need=Need.IF_THERE),
        Adjustment("ExposureTime", settings.exposure_us),
        Adjustment("Gain", settings.gain_db, all_gains),
    ]
    colours = (("Red", settings.white_balance_red), ("Blue", settings.white_balance_blue))
    found += [
        Adjustment(ratio, value, (f"{ratio}Selector", colour))
        for colour, value in colours
        if value is not None
    ]
    return found


def _trigger(settings: HeadSettings, part: Part) -> list[Adjustment]:
    at = ("TriggerSelector", "FrameStart")
    source = settings.follower_line if part is Part.FOLLOWER else settings.trigger
    return [
        Adjustment("TriggerSource", source, at, Need.MUST),
        Adjustment("TriggerActivation", "RisingEdge", at, Need.IF_THERE),
        Adjustment("TriggerDelay", 0.0, at, Need.IF_THERE),
        Adjustment("TriggerMode", True, at, Need.MUST),
    ]


def _lines(settings: HeadSettings, part: Part) -> list[Adjustment]:
    if part is Part.FOLLOWER:
        return [_mode(settings.follower_line, "Input", Need.IF_THERE)]
    found = []
    if settings.strobe_line:
        found += [
            _mode(settings.strobe_line, "Output", Need.IF_THERE),
            *_timer(settings),
            *for_flash(settings)[1:],
        ]
    if part is Part.LEADER:
        at = ("LineSelector", settings.sync_line)
        found += [
            _mode(settings.sync_line, "Output", Need.IF_THERE),
            Adjustment("LineSource", EXPOSURE_ACTIVE, at, Need.MUST),
        ]
    return found


def _signals(settings: HeadSettings) -> list[Adjustment]:
    """Lines that are only read: to name one that is not there would stay without effect."""
    named = (settings.shutter_line, settings.charged_line)
    return [_mode(line, "Input", Need.SHOULD) for line in named if line]


def _timer(settings: HeadSettings) -> list[Adjustment]:
    if not settings.strobe_source.startswith("Timer"):
        return []
    at = ("TimerSelector", settings.strobe_source.removesuffix("Active"))
    found = [
        Adjustment("TimerTriggerSource", "ExposureStart", at),
        Adjustment("TimerDelay", 0.0, at, Need.IF_THERE),
    ]
    if settings.flash_us is not None:
        found.append(Adjustment("TimerDuration", settings.flash_us, at))
    return found


def _mode(line: str, mode: str, need: Need) -> Adjustment:
    return Adjustment("LineMode", mode, ("LineSelector", line), need)
