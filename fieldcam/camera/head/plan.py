"""Which features a head's cameras are set up with, by their SFNC names."""

from __future__ import annotations

from enum import Enum, auto

from fieldcam.camera.genapi import NodeMap
from fieldcam.camera.head.adjusting import Adjustment, Need, adjust, has
from fieldcam.camera.head.settings import HeadSettings
from fieldcam.errors import FeatureRefused

OFF = "Off"
USER_OUTPUT = "UserOutput"
EXPOSURE_ACTIVE = "ExposureActive"


class HeadPart(Enum):
    """What one camera does in its head."""

    ALONE = auto()
    LEADER = auto()
    """Is triggered, fires the flash, and triggers the follower."""
    FOLLOWER = auto()


def setting_up(settings: HeadSettings, part: HeadPart) -> list[Adjustment]:
    """All that stays the same while the camera is open, in the order to be set."""
    return [
        Adjustment("AcquisitionMode", "Continuous", need=Need.IF_THERE),
        *_picture(settings),
        *_exposure(settings),
        *_trigger(settings, part),
        *_lines(settings, part),
        *([] if part is HeadPart.FOLLOWER else _signals(settings)),
    ]


def for_flash(settings: HeadSettings) -> list[Adjustment]:
    """Of the camera that has the flash: every picture is lit."""
    adjustments = [Adjustment("ExposureTime", settings.exposure_us)]
    if settings.strobe_line:
        at = ("LineSelector", settings.strobe_line)
        adjustments.append(_mode(settings.strobe_line, "Output", Need.IF_THERE))
        adjustments.append(Adjustment("LineSource", settings.strobe_source, at))
    return adjustments


def for_aiming(features: NodeMap, line: str, exposure_us: float) -> list[Adjustment]:
    """Of the camera that has the flash on this line: no picture is lit.

    The standard leaves it to a camera whether a line's source can be `Off`: else it is an
    output of the user's that stays low, else the line drives nothing. Raises FeatureMissing
    or FeatureRefused where the flash cannot be kept from firing.
    """
    if not line:
        raise FeatureRefused("The head fires its flash by itself.")
    at = ("LineSelector", line)
    if has(features, at[0]):
        adjust(features, [Adjustment(*at, need=Need.MUST)])
    sources = features.enumeration("LineSource").symbols if has(features, "LineSource") else ()
    low = next((source for source in sources if source.startswith(USER_OUTPUT)), None)
    if OFF in sources:
        dark = [Adjustment("LineSource", OFF, at, Need.MUST)]
    elif low is not None and has(features, "UserOutputValue"):
        dark = [
            Adjustment("UserOutputValue", False, ("UserOutputSelector", low), Need.MUST),
            Adjustment("LineSource", low, at, Need.MUST),
        ]
    else:
        dark = [_mode(line, "Input", Need.MUST)]
    return [*dark, Adjustment("ExposureTime", exposure_us)]


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
    others = ("AnalogAll", "Tap1", "DigitalAll")
    found = [
        Adjustment("ExposureMode", "Timed", need=Need.IF_THERE),
        Adjustment("ExposureAuto", OFF, need=Need.IF_THERE),
        Adjustment("GainAuto", OFF, all_gains, Need.IF_THERE, others),
        Adjustment("BalanceWhiteAuto", OFF, need=Need.IF_THERE),
        Adjustment("ExposureTime", settings.exposure_us),
        Adjustment("Gain", settings.gain_db, all_gains, at_others=others),
    ]
    colours = (("Red", settings.white_balance_red), ("Blue", settings.white_balance_blue))
    found += [
        Adjustment(ratio, value, (f"{ratio}Selector", colour))
        for colour, value in colours
        if value is not None
    ]
    return found


def _trigger(settings: HeadSettings, part: HeadPart) -> list[Adjustment]:
    at, others = ("TriggerSelector", "FrameStart"), ("ExposureStart",)
    source = settings.follower_line if part is HeadPart.FOLLOWER else settings.trigger
    return [
        Adjustment("TriggerSource", source, at, Need.MUST, others),
        Adjustment("TriggerActivation", "RisingEdge", at, Need.IF_THERE, others),
        Adjustment("TriggerDelay", 0.0, at, Need.IF_THERE, others),
        Adjustment("TriggerMode", True, at, Need.MUST, others),
    ]


def _lines(settings: HeadSettings, part: HeadPart) -> list[Adjustment]:
    if part is HeadPart.FOLLOWER:
        return [_mode(settings.follower_line, "Input", Need.IF_THERE)]
    found = []
    if settings.strobe_line:
        found += [
            *_timer(settings),
            *for_flash(settings)[1:],
        ]
    if part is HeadPart.LEADER:
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
