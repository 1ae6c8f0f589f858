"""The emulated camera's features by their SFNC names, each with the register behind it.

One table makes both the registers and the XML file that describes them
(`genapi_xml`), so that the two cannot differ.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from .protocol import EXPOSURE_END_EVENT, SHUTTER_EVENT, Format
from .registers import Access

LINES = {"Line0": 0, "Line1": 1, "Line2": 2}
"""Shutter button; strobe output; the wire between two heads."""
SHUTTER_LINE, STROBE_LINE, SYNC_LINE = "Line0", "Line1", "Line2"
OFF_ON = {"Off": 0, "On": 1}
CHUNKS = {"FrameID": 0, "Timestamp": 1, "ExposureTime": 2, "Gain": 3, "LineStatusAll": 4}
SOURCE_CHUNK_ID = 0x0106
CHUNK_IDS = {
    "FrameID": 0x0101,
    "Timestamp": 0x0102,
    "ExposureTime": 0x0103,
    "Gain": 0x0104,
    "LineStatusAll": 0x0105,
}


class Lock(Enum):
    """When a feature may be written."""

    NEVER = "free"
    WHILE_STREAMING = "TLParamsLocked"


@dataclass(frozen=True, slots=True, kw_only=True)
class Feature:
    """A feature with one register of `length` bytes for each entry of its selector."""

    name: str
    category: str
    access: Access = Access.RW
    length: int = 4
    selector: str | None = None
    lock: Lock = Lock.NEVER
    volatile: bool = False
    """Changes by itself, so that a host may not keep it."""
    shown: str = "Beginner"
    available_by: str | None = None
    """The switch without which it is not there."""
    changed_by: tuple[str, ...] = ()
    """Features that a host writes and that change this one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Integer(Feature):
    minimum: int = 0
    maximum: int | str = 0xFFFF_FFFF
    """A number, or the feature that holds it."""
    increment: int = 1
    initial: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Real(Feature):
    """A double in a register of its own."""

    length: int = 8
    unit: str = ""
    minimum: float = 0.0
    maximum: float = 1e9
    initial: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Scaled(Feature):
    """A real number kept as a whole one, `per_unit` times as large."""

    unit: str = ""
    per_unit: int
    minimum: float = 0.0
    maximum: float
    initial: float = 0.0
    signed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice(Feature):
    entries: dict[str, int]
    initial: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Switch(Feature):
    initial: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Button(Feature):
    """A command: writing 1 does it, and it reads 0 once it is done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bits(Feature):
    """One bit of a register of another feature for each entry of the selector."""

    of: str
    access: Access = Access.RO


@dataclass(frozen=True, slots=True, kw_only=True)
class Text(Feature):
    """A text in a bootstrap register."""

    address: int
    length: int = 64
    access: Access = Access.RO


@dataclass(frozen=True, slots=True, kw_only=True)
class Derived(Feature):
    """A whole number that the host works out itself."""

    formula: str
    variables: dict[str, str]
    access: Access = Access.RO


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivered(Feature):
    """A number that comes with a picture (chunk) or an event, not from a register."""

    port_id: int
    kind: str
    """Chunk or Event."""
    length: int = 8
    is_real: bool = False
    access: Access = Access.RO


def table(sensor_px: tuple[int, int], sources: tuple[str, ...]) -> tuple[Feature, ...]:
    """All features of a camera whose images are at most (width, height) pixels."""
    width, height = sensor_px
    return (
        *_device(),
        *_picture(width, height, sources),
        *_acquisition(),
        *_analog(),
        *_lines(),
        *_events(),
        *_chunks(len(sources) > 1),
        *_transport(width * height),
    )


def _device() -> tuple[Feature, ...]:
    of, ro = "DeviceControl", Access.RO
    return (
        Text(name="DeviceVendorName", category=of, address=0x004),
        Text(name="DeviceModelName", category=of, address=0x044),
        Text(name="DeviceVersion", category=of, address=0x0C4),
        Text(name="DeviceManufacturerInfo", category=of, address=0x104),
        Text(name="DeviceFirmwareVersion", category=of, address=0x0C4),
        Text(name="DeviceSerialNumber", category=of, address=0x144),
        Text(name="DeviceUserID", category=of, address=0x184, access=Access.RW),
        Button(name="DeviceReset", category=of, access=Access.WO, shown="Guru"),
        Scaled(
            name="DeviceTemperature",
            category=of,
            access=ro,
            unit="C",
            per_unit=16,
            signed=True,
            minimum=-40.0,
            maximum=125.0,
            initial=38.5,
            volatile=True,
        ),
        Button(name="TimestampLatch", category=of, access=Access.WO, shown="Expert"),
        Integer(
            name="TimestampLatchValue",
            category=of,
            access=ro,
            length=8,
            maximum=2**63 - 1,
            changed_by=("TimestampLatch",),
        ),
        Integer(name="LinkErrorCount", category=of, access=ro, volatile=True, shown="Expert"),
        Integer(name="LinkRecoveryCount", category=of, access=ro, volatile=True, shown="Expert"),
        Choice(name="DeviceLinkThroughputLimitMode", category=of, entries=OFF_ON),
        Integer(
            name="DeviceLinkThroughputLimit",
            category=of,
            minimum=1_000_000,
            maximum=400_000_000,
            initial=400_000_000,
        ),
        Choice(name="UserSetSelector", category="UserSetControl", entries=USER_SETS),
        _user_set("UserSetLoad"),
        _user_set("UserSetSave"),
    )


def _user_set(name: str) -> Button:
    held = Lock.WHILE_STREAMING
    return Button(name=name, category="UserSetControl", access=Access.WO, lock=held)


USER_SETS = {"Default": 0, "UserSet0": 1}


def _picture(width: int, height: int, sources: tuple[str, ...]) -> tuple[Feature, ...]:
    of, held = "ImageFormatControl", Lock.WHILE_STREAMING
    formats = {"Mono8": int(Format.MONO8), "BayerRG8": int(Format.BAYER_RG8)}
    several = (
        Integer(name="SourceCount", category=of, access=Access.RO, initial=len(sources)),
        Choice(name="SourceSelector", category=of, entries={s: i for i, s in enumerate(sources)}),
    )
    return (
        *(several if len(sources) > 1 else ()),
        Integer(name="SensorWidth", category=of, access=Access.RO, initial=width),
        Integer(name="SensorHeight", category=of, access=Access.RO, initial=height),
        _side("Width", width, 8, held),
        _side("Height", height, 2, held),
        Integer(name="OffsetX", category=of, maximum=width - 8, increment=8, lock=held),
        Integer(name="OffsetY", category=of, maximum=height - 2, increment=2, lock=held),
        Choice(
            name="PixelFormat",
            category=of,
            entries=formats,
            initial=int(Format.BAYER_RG8),
            lock=held,
        ),
        Derived(
            name="PixelSize",
            category=of,
            formula="(FMT >> 16) & 0xFF",
            variables={"FMT": "PixelFormat"},
        ),
    )


def _side(name: str, longest: int, step: int, lock: Lock) -> Integer:
    return Integer(
        name=name,
        category="ImageFormatControl",
        minimum=step,
        maximum=f"Sensor{name}",
        increment=step,
        initial=longest,
        lock=lock,
    )


def _acquisition() -> tuple[Feature, ...]:
    of = "AcquisitionControl"
    sources = {"Software": 0, **{name: 1 + index for name, index in LINES.items()}}
    edges = {"RisingEdge": 0, "FallingEdge": 1}
    return (
        Choice(
            name="AcquisitionMode",
            category=of,
            entries={"SingleFrame": 0, "Continuous": 1},
            initial=1,
            lock=Lock.WHILE_STREAMING,
        ),
        Button(name="AcquisitionStart", category=of),
        Button(name="AcquisitionStop", category=of),
        Switch(name="AcquisitionFrameRateEnable", category=of, initial=True),
        Real(
            name="AcquisitionFrameRate",
            category=of,
            available_by="AcquisitionFrameRateEnable",
            unit="Hz",
            minimum=0.5,
            maximum=120.0,
            initial=30.0,
        ),
        Choice(name="TriggerSelector", category=of, entries={"FrameStart": 0}),
        Choice(name="TriggerMode", category=of, entries=OFF_ON, selector="TriggerSelector"),
        Choice(name="TriggerSource", category=of, entries=sources, selector="TriggerSelector"),
        Choice(name="TriggerActivation", category=of, entries=edges, selector="TriggerSelector"),
        Choice(
            name="TriggerOverlap",
            category=of,
            entries={"Off": 0, "ReadOut": 1},
            selector="TriggerSelector",
        ),
        Real(name="TriggerDelay", category=of, unit="us", maximum=1e6, selector="TriggerSelector"),
        Button(name="TriggerSoftware", category=of, access=Access.WO, selector="TriggerSelector"),
        Choice(name="ExposureMode", category=of, entries={"Timed": 0}),
        Real(
            name="ExposureTime",
            category=of,
            unit="us",
            minimum=20.0,
            maximum=200_000.0,
            initial=500.0,
        ),
        Choice(name="ExposureAuto", category=of, entries={"Off": 0, "Continuous": 2}, initial=2),
    )


def _analog() -> tuple[Feature, ...]:
    of, colours = "AnalogControl", {"Red": 0, "Blue": 1}
    automatic = {"Off": 0, "Continuous": 2}
    return (
        Choice(name="GainSelector", category=of, entries={"All": 0}),
        Scaled(
            name="Gain", category=of, unit="dB", per_unit=10, maximum=24.0, selector="GainSelector"
        ),
        Choice(name="GainAuto", category=of, entries=automatic, selector="GainSelector"),
        Scaled(name="BlackLevel", category=of, per_unit=16, maximum=31.0),
        Choice(name="BalanceRatioSelector", category=of, entries=colours),
        Scaled(
            name="BalanceRatio",
            category=of,
            per_unit=1024,
            minimum=0.25,
            maximum=4.0,
            initial=1.0,
            selector="BalanceRatioSelector",
        ),
        Choice(name="BalanceWhiteAuto", category=of, entries=automatic),
    )


LINE_MODES = {"Input": 0, "Output": 1}
LINE_SOURCES = {"Off": 0, "ExposureActive": 1, "Timer0Active": 2, "UserOutput0": 3}


def _lines() -> tuple[Feature, ...]:
    of, by = "DigitalIOControl", "LineSelector"
    timer = "CounterAndTimerControl"
    return (
        Choice(name=by, category=of, entries=LINES),
        Choice(name="LineMode", category=of, entries=LINE_MODES, selector=by),
        Switch(name="LineInverter", category=of, selector=by),
        Choice(name="LineSource", category=of, entries=LINE_SOURCES, selector=by),
        Integer(name="LineStatusAll", category=of, access=Access.RO, volatile=True),
        Bits(name="LineStatus", category=of, of="LineStatusAll", selector=by),
        Choice(name="UserOutputSelector", category=of, entries={"UserOutput0": 0}),
        Switch(name="UserOutputValue", category=of, selector="UserOutputSelector"),
        Choice(name="TimerSelector", category=timer, entries={"Timer0": 0}),
        Choice(
            name="TimerTriggerSource",
            category=timer,
            entries={"Off": 0, "ExposureStart": 1},
            selector="TimerSelector",
        ),
        Real(
            name="TimerDuration",
            category=timer,
            unit="us",
            maximum=100_000.0,
            initial=300.0,
            selector="TimerSelector",
        ),
        Real(
            name="TimerDelay",
            category=timer,
            unit="us",
            maximum=100_000.0,
            selector="TimerSelector",
        ),
    )


EVENTS = {"ExposureEnd": 0, "Line0RisingEdge": 1}


def _events() -> tuple[Feature, ...]:
    of = "EventControl"
    return (
        Choice(name="EventSelector", category=of, entries=EVENTS),
        Choice(name="EventNotification", category=of, entries=OFF_ON, selector="EventSelector"),
        Delivered(
            name="EventExposureEndFrameID",
            category=of,
            kind="Event",
            port_id=EXPOSURE_END_EVENT,
        ),
        Delivered(
            name="EventLine0RisingEdgeCount", category=of, kind="Event", port_id=SHUTTER_EVENT
        ),
    )


def _chunks(several_sources: bool) -> tuple[Feature, ...]:
    of = "ChunkDataControl"
    delivered = [
        Delivered(
            name=f"Chunk{name}",
            category=of,
            kind="Chunk",
            port_id=chunk_id,
            is_real=name in ("ExposureTime", "Gain"),
        )
        for name, chunk_id in CHUNK_IDS.items()
    ]
    if several_sources:
        delivered.append(
            Delivered(name="ChunkSourceID", category=of, kind="Chunk", port_id=SOURCE_CHUNK_ID)
        )
    return (
        Switch(name="ChunkModeActive", category=of, lock=Lock.WHILE_STREAMING),
        Choice(name="ChunkSelector", category=of, entries=CHUNKS),
        Switch(
            name="ChunkEnable", category=of, selector="ChunkSelector", lock=Lock.WHILE_STREAMING
        ),
        *delivered,
    )


def _transport(pixels: int) -> tuple[Feature, ...]:
    of = "TransportLayerControl"
    return (
        Integer(
            name="PayloadSize",
            category=of,
            access=Access.RO,
            initial=pixels,
            changed_by=("Width", "Height", "PixelFormat", "ChunkModeActive", "ChunkEnable"),
        ),
        Integer(name="TLParamsLocked", category=of, maximum=1, shown="Guru", volatile=True),
    )
