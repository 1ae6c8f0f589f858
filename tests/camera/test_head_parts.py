"""The head's pure parts: brightness, previews, layouts, and features that a camera lacks."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from register_files import MemoryRegisters, node_map, register

from fieldcam.camera.genapi import NodeMap
from fieldcam.camera.head import watching
from fieldcam.camera.head.adjusting import Adjustment, Need, adjust
from fieldcam.camera.head.assembly import layout_doubt, told_by_image
from fieldcam.camera.head.opening import choose
from fieldcam.camera.head.pictures import (
    GREY,
    LONGEST_PREVIEW_US,
    brightness,
    flash_fired,
    next_exposure_us,
    shrunk,
)
from fieldcam.camera.head.plan import HeadPart, for_aiming, for_flash, setting_up
from fieldcam.camera.head.settings import Carrying, HeadSettings
from fieldcam.camera.usb3vision.devices import AttachedCamera, CameraNames
from fieldcam.camera.usb3vision.transport import LinkSpeed
from fieldcam.errors import (
    CameraForbidden,
    CameraRefused,
    CameraUnplugged,
    FeatureMissing,
    FeatureRefused,
)
from fieldcam.values import PixelFormat

TRIGGER_MODE = """<Enumeration Name="TriggerMode"><EnumEntry Name="Off"><Value>0</Value></EnumEntry>
<EnumEntry Name="On"><Value>1</Value></EnumEntry><pValue>ModeReg</pValue></Enumeration>"""
GAIN = "<Integer Name='Gain'><pValue>GainReg</pValue><Min>0</Min><Max>10</Max></Integer>"
MAP = (register("ModeReg", 0), TRIGGER_MODE, register("GainReg", 4), GAIN)


def test_features_are_set_and_read_back() -> None:
    registers = MemoryRegisters()
    done = adjust(
        node_map(*MAP, registers=registers),
        [Adjustment("TriggerMode", True), Adjustment("Gain", 3.0)],
    )
    assert (done.values, done.lacks) == ({"TriggerMode": "On", "Gain": 3}, [])
    assert (registers.memory[0], registers.memory[4]) == (1, 3)


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        (Adjustment("Gain", 11), "Gain cannot be 11"),
        (Adjustment("TriggerMode", "Perhaps"), "TriggerMode cannot be 'Perhaps'"),
        (Adjustment("BalanceRatio", 2.0), "no feature BalanceRatio"),
    ],
)
def test_what_a_camera_lacks_is_a_sentence_or_an_error(wanted: Adjustment, words: str) -> None:
    done = adjust(node_map(*MAP), [wanted, Adjustment("Gain", 2)])
    assert len(done.lacks) == 1 and words in done.lacks[0]
    assert done.values == {"Gain": 2}
    quiet = Adjustment("BalanceRatio", 2.0, need=Need.IF_THERE)
    assert adjust(node_map(*MAP), [quiet]).lacks == []
    with pytest.raises(FeatureMissing):
        adjust(node_map(*MAP), [Adjustment("TriggerSource", "Software", need=Need.MUST)])


class Rounding(MemoryRegisters):
    """Keeps even numbers only."""

    def write(self, address: int, data: bytes) -> None:
        super().write(address, bytes((data[0] & 0xFE, *data[1:])))


def test_what_the_camera_made_of_a_value_is_told() -> None:
    done = adjust(node_map(*MAP, registers=Rounding()), [Adjustment("Gain", 5)])
    assert done.lacks == ["Gain was set to 5 and is 4."]


INPUT_ONLY = """<Enumeration Name="LineSelector"><EnumEntry Name="Line0"><Value>0</Value>
</EnumEntry><EnumEntry Name="Line1"><Value>1</Value></EnumEntry><pValue>SelectorReg</pValue>
</Enumeration><Enumeration Name="LineMode"><EnumEntry Name="Input"><Value>0</Value></EnumEntry>
<EnumEntry Name="Output"><Value>1</Value></EnumEntry><pValue>ModeReg</pValue></Enumeration>"""


def test_each_lack_is_said_once_and_names_its_line() -> None:
    features = node_map(
        register("SelectorReg", 0), register("ModeReg", 4, AccessMode="RO"), INPUT_ONLY
    )

    def lacks(line: str) -> list[str]:
        at = ("LineSelector", line)
        wanted = [Adjustment("LineMode", "Output", at), Adjustment("LineMode", True, at)]
        return adjust(features, wanted).lacks

    assert lacks("Line0") == [
        "Line0: LineMode cannot be set: it can only be read, or is locked now."
    ]
    assert lacks("Line9") == ["LineSelector cannot be 'Line9': it takes Line0, Line1."]


LINES = """<Enumeration Name="LineSelector"><EnumEntry Name="Line0"><Value>0</Value></EnumEntry>
<EnumEntry Name="Line1"><Value>1</Value></EnumEntry><pValue>SelectorReg</pValue></Enumeration>
<Boolean Name="LineStatus"><pValue>StatusReg</pValue></Boolean>"""


def test_a_button_without_events_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watching, "POLL_EVERY_S", 0.0)
    registers = MemoryRegisters()
    nodes = (register("SelectorReg", 8), register("StatusReg", 12), LINES)
    went_down = watching.by_level(
        node_map(*nodes, registers=registers), "Line1", threading.RLock(), threading.Event()
    )
    told = []
    # A button that is held while the camera is opened was not pressed.
    for level in (1, 1, 0, 1, 1, 0, 0, 1):
        registers.memory[12] = level
        told.append(went_down())
    assert told == [False, False, False, True, False, False, False, True]
    assert registers.memory[8] == 1


SELECTOR = """<Enumeration Name="LineSelector"><EnumEntry Name="Line0"><Value>0</Value></EnumEntry>
<EnumEntry Name="Line1"><Value>1</Value></EnumEntry><pValue>SelectorReg</pValue></Enumeration>"""
MODE = """<Enumeration Name="LineMode"><EnumEntry Name="Input"><Value>0</Value></EnumEntry>
<EnumEntry Name="Output"><Value>1</Value></EnumEntry><pValue>ModeReg</pValue></Enumeration>"""
USER_OUTPUT = "<Boolean Name='UserOutputValue'><pValue>UserReg</pValue></Boolean>"
EXPOSURE = "<Float Name='ExposureTime'><Value>300</Value></Float>"


def line_features(*sources: str, extra: str = "") -> tuple[NodeMap, MemoryRegisters]:
    """A line whose source can be one of these; its mode is Output, its user's output high."""
    entries = "".join(
        f'<EnumEntry Name="{name}"><Value>{i}</Value></EnumEntry>' for i, name in enumerate(sources)
    )
    source = f'<Enumeration Name="LineSource">{entries}<pValue>SourceReg</pValue></Enumeration>'
    registers = MemoryRegisters()
    registers.memory[8] = registers.memory[12] = 1
    names = ("SelectorReg", "SourceReg", "ModeReg", "UserReg")
    stored = [register(name, 4 * i) for i, name in enumerate(names)]
    nodes = (*stored, SELECTOR, MODE, source, EXPOSURE, extra)
    return node_map(*nodes, registers=registers), registers


def test_the_flash_is_kept_dark_by_what_the_camera_offers() -> None:
    """`Off` is optional in the standard: Flea3 and Grasshopper3 do not have it."""
    cases = (
        (("ExposureActive", "Off"), USER_OUTPUT, "Off", (1, 1)),
        (("ExposureActive", "UserOutput1"), USER_OUTPUT, "UserOutput1", (1, 0)),
        (("ExposureActive", "UserOutput1"), "", "ExposureActive", (0, 1)),
        (("ExposureActive", "ExternalTriggerActive"), USER_OUTPUT, "ExposureActive", (0, 1)),
    )
    for sources, extra, left, (mode, level) in cases:
        features, registers = line_features(*sources, extra=extra)
        adjust(features, for_aiming(features, "Line1", 5000.0))
        assert features.enumeration("LineSource").value == left
        assert (registers.memory[0], registers.memory[8], registers.memory[12]) == (1, mode, level)
        assert adjust(features, for_flash(HeadSettings())).lacks == []
        assert features.enumeration("LineSource").value == "ExposureActive"
        assert features.enumeration("LineMode").value == "Output"


def test_no_other_line_is_touched_to_keep_a_flash_dark() -> None:
    for line, words in (("Line7", "takes Line0, Line1"), ("", "fires its flash by itself")):
        features, registers = line_features("ExposureActive", "Off")
        before = bytes(registers.memory)
        with pytest.raises(FeatureRefused, match=words):
            for_aiming(features, line, 5000.0)
        assert bytes(registers.memory) == before


def test_a_selector_without_the_usual_entry_is_set_to_what_serves_as_well() -> None:
    selector = """<Enumeration Name="GainSelector">
    <EnumEntry Name="Red"><Value>1</Value></EnumEntry>
    <EnumEntry Name="AnalogAll"><Value>2</Value></EnumEntry>
    <pValue>ModeReg</pValue></Enumeration>"""
    registers = MemoryRegisters()
    features = node_map(*MAP, selector, registers=registers)
    gain = next(each for each in setting_up(HeadSettings(), HeadPart.ALONE) if each.name == "Gain")
    assert adjust(features, [gain]).lacks == [] and registers.memory[0] == 2


class Refusing(MemoryRegisters):
    def write(self, address: int, data: bytes) -> None:
        raise CameraRefused(f"The camera refused to write at {address}: no.", why="access denied")


def test_a_refused_write_names_its_feature() -> None:
    features = node_map(*MAP, registers=Refusing())
    assert adjust(features, [Adjustment("Gain", 3)]).lacks == [
        "The camera refused to set Gain: access denied."
    ]
    with pytest.raises(CameraRefused, match="refused to set TriggerMode: access denied"):
        features.enumeration("TriggerMode").value = "On"


@given(st.floats(0, 255), st.floats(20, LONGEST_PREVIEW_US))
def test_the_preview_comes_to_its_brightness_and_stays_there(light: float, start: float) -> None:
    per_us, exposure_us = light / 1000, start
    for _ in range(6):
        exposure_us = next_exposure_us(exposure_us, min(255.0, per_us * exposure_us))
    mean = per_us * exposure_us
    reachable = per_us * LONGEST_PREVIEW_US > GREY
    assert 20 <= exposure_us <= LONGEST_PREVIEW_US
    assert GREY / 1.5 < mean < GREY * 1.5 or not reachable or exposure_us <= 20


@pytest.mark.parametrize(
    ("mean", "ambient", "fired"),
    [
        (90.0, None, True),
        (2.0, None, False),
        (2.0, 1.9, False),
        (8.0, 1.0, True),
        (8.0, None, False),
        (40.0, 40.0, True),
    ],
)
def test_only_a_picture_that_is_black_is_called_unlit(
    mean: float, ambient: float | None, fired: bool
) -> None:
    assert flash_fired(mean, ambient) is fired


@given(st.integers(1, 60), st.integers(1, 60))
def test_brightness_is_the_mean_of_any_size(height: int, width: int) -> None:
    image = np.full((height * 8, width * 8), 77, np.uint8)
    assert brightness(image) == 77
    assert brightness(np.dstack([image] * 3)) == 77


@pytest.mark.parametrize(
    ("pixel_format", "red"),
    [
        (PixelFormat.BAYER_RG8, (0, 0)),
        (PixelFormat.BAYER_GR8, (0, 1)),
        (PixelFormat.BAYER_GB8, (1, 0)),
        (PixelFormat.BAYER_BG8, (1, 1)),
    ],
)
def test_a_mosaic_keeps_its_colours(pixel_format: PixelFormat, red: tuple[int, int]) -> None:
    image = np.full((1080, 1440), 50, np.uint8)
    image[red[0] :: 2, red[1] :: 2] = 200
    image[1 - red[0] :: 2, 1 - red[1] :: 2] = 10
    small, step = shrunk(image, pixel_format)
    assert (small.shape, step) == ((540, 720, 3), 2)
    assert np.all(small == (200, 50, 10))


def test_grey_and_colour_pictures_are_thinned_out() -> None:
    small, step = shrunk(np.zeros((100, 4000), np.uint8), PixelFormat.MONO8)
    assert (small.shape, step) == ((17, 667), 6)
    small, step = shrunk(np.zeros((100, 100, 3), np.uint8), PixelFormat.RGB8)
    assert (small.shape, step) == ((50, 50, 3), 2)


@pytest.mark.parametrize(
    ("size_px", "sources", "carrying"),
    [
        ((2880, 1080), 1, Carrying.SIDE_BY_SIDE),
        ((1440, 2160), 1, Carrying.STACKED),
        ((1440, 1080), 2, Carrying.ALTERNATING),
        ((1440, 1080), 1, Carrying.TWO_DEVICES),
    ],
)
def test_one_cameras_layout_is_told_by_its_image(
    size_px: tuple[int, int], sources: int, carrying: Carrying
) -> None:
    assert told_by_image(size_px, sources) is carrying


@pytest.mark.parametrize(
    ("carrying", "size_px", "sources", "words"),
    [
        (Carrying.SIDE_BY_SIDE, (1440, 1080), 1, "side by side, but look like one eye's"),
        (Carrying.STACKED, (2880, 1080), 1, "above the other, but look like both eyes' side by"),
        (Carrying.TWO_DEVICES, (2880, 1080), 1, "one eye's, but look like both eyes' side by"),
        (Carrying.ALTERNATING, (1440, 1080), 1, "in turn, but look like one eye's"),
        (Carrying.SIDE_BY_SIDE, (2880, 1080), 2, "side, but look like the left and the right"),
    ],
)
def test_a_layout_that_the_image_does_not_look_like_is_doubted(
    carrying: Carrying, size_px: tuple[int, int], sources: int, words: str
) -> None:
    doubt = layout_doubt(carrying, size_px, sources)
    assert doubt is not None and words in doubt and "`layout`" in doubt
    assert f"{size_px[0]} x {size_px[1]} pixels" in doubt
    assert layout_doubt(told_by_image(size_px, sources), size_px, sources) is None


def attached(serial: str, trouble: CameraForbidden | None = None) -> AttachedCamera:
    names = CameraNames("Maker", "Eye", serial)
    return AttachedCamera(names, (1, 2), 1, 5, (1,), LinkSpeed.SUPER, 112, trouble)


def test_unknown_eyes_are_ordered_by_serial_wherever_they_are_plugged_in() -> None:
    for order in ("BA", "AB"):
        chosen, notes = choose(HeadSettings(), [attached(serial) for serial in order])
        assert [camera.names.serial for camera in chosen] == ["A", "B"]
        assert "A is taken for the left camera" in notes[0]


def test_the_only_other_camera_is_the_right_one_where_left_alone_is_named() -> None:
    chosen, notes = choose(HeadSettings(left="B"), [attached("A"), attached("B")])
    assert [camera.names.serial for camera in chosen] == ["B", "A"]
    assert notes == ["A is taken for the right camera: camera.toml names only the left."]
    alone = HeadSettings(left="B", layout=Carrying.SIDE_BY_SIDE)
    assert choose(alone, [attached("A"), attached("B")]) == ([attached("B")], [])


@pytest.mark.parametrize(
    ("settings", "plugged", "words"),
    [
        (HeadSettings(), "", "No camera is plugged in"),
        (HeadSettings(left="A", right="B"), "A", "The right camera B is not plugged in, only A"),
        (HeadSettings(left="A", right="B"), "BC", "The left camera A is not plugged in, only B"),
    ],
)
def test_a_missing_eye_is_named(settings: HeadSettings, plugged: str, words: str) -> None:
    with pytest.raises(CameraUnplugged, match=words):
        choose(settings, [attached(serial) for serial in plugged])


def test_an_eye_whose_name_may_not_be_read_is_no_missing_one() -> None:
    with pytest.raises(CameraForbidden):
        choose(HeadSettings(left="A"), [attached("", CameraForbidden("No.", "Rule."))])
