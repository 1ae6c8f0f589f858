"""camera.toml: what is read, where from, and the one sentence for each thing that is wrong."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcam.camera.head.settings import (
    Carrying,
    HeadSettings,
    load_settings,
    parse_settings,
)
from fieldcam.errors import CameraSettingsInvalid

PAGE = Path(__file__).parents[2] / "docs" / "camera.md"
WHOLE = """
left = "A"
right = "B"
layout = "two-devices"
leader = "B"
exposure_us = 250
gain_db = 1.5
trigger = "Line0"
strobe_line = ""
"""


def parsed(text: str) -> HeadSettings:
    return parse_settings(text.encode(), "camera.toml")


def test_all_that_is_given_is_taken() -> None:
    found = parsed(WHOLE)
    assert (found.left, found.right, found.layout) == ("A", "B", Carrying.TWO_DEVICES)
    assert (found.leader, found.exposure_us, found.gain_db) == ("B", 250.0, 1.5)
    assert (found.trigger, found.strobe_line) == ("Line0", "")
    assert parsed("") == HeadSettings()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("left = ", "is no proper TOML"),
        ("left = \x00", "is no proper TOML"),
        ("exposure = 3", "has exposure, which is none of left, right"),
        ("exposure_us = 0", "gives exposure_us as 0, where a number from 1 to 1e\\+06 µs"),
        ("exposure_us = true", "gives exposure_us as True"),
        ("exposure_us = nan", "gives exposure_us as nan"),
        ('gain_db = "high"', "gives gain_db as 'high'"),
        ("throughput_bytes_per_s = 1.5", "a whole number from"),
        ('layout = "beside"', '"two-devices" or "side-by-side"'),
        ("leader = 7", "a serial number in quotes"),
        ('left = ""', "a serial number in quotes"),
        ("[left]\nserial = 3", "gives left as {'serial': 3}"),
        ('right = "B"', "names the right camera and not the left one"),
        ('left = "A"\nright = "A"', "names A as the left and as the right"),
        ('shutter_line = "Line1"', "gives Line1 as strobe_line and as shutter_line"),
        ('strobe_line = "Line0"\ntrigger = "Line0"', "as strobe_line and as trigger"),
        ('strobe_line = "Line3"\ncharged_line = "Line3"', "as strobe_line and as charged_line"),
        ('left = "A"\nright = "B"\nlayout = "stacked"', "the layout stacked has one only"),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(text: str, words: str) -> None:
    with pytest.raises(CameraSettingsInvalid, match=words) as caught:
        parsed(text)
    assert "\n" not in caught.value.message or "TOML" in caught.value.message
    assert caught.value.message.startswith("camera.toml ")


def test_a_flash_that_needs_no_line_leaves_all_lines_to_others() -> None:
    found = parsed('strobe_line = ""\nshutter_line = "Line1"\ntrigger = "Line1"')
    assert found.shutter_line == found.trigger == "Line1"


@given(st.binary(max_size=80))
def test_fuzz_any_bytes_are_settings_or_refused(content: bytes) -> None:
    try:
        assert isinstance(parse_settings(content, "camera.toml"), HeadSettings)
    except CameraSettingsInvalid as error:
        assert error.hint


def test_the_data_folders_file_goes_before_the_users(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    data = tmp_path / "data"
    data.mkdir()
    assert load_settings(data) == HeadSettings()
    own = tmp_path / "config" / "fieldcam" / "camera.toml"
    own.parent.mkdir(parents=True)
    own.write_text("gain_db = 1")
    assert load_settings(data).gain_db == load_settings(None).gain_db == 1
    (data / "camera.toml").write_text("gain_db = 2")
    assert load_settings(data).gain_db == 2


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "camera.toml").mkdir()
    with pytest.raises(CameraSettingsInvalid, match=r"camera\.toml is a folder, not a file of"):
        load_settings(tmp_path)


def test_a_feature_file_lies_beside_camera_toml_or_anywhere(tmp_path: Path) -> None:
    for named, expected in (("ace.zip", tmp_path / "ace.zip"), ("/x/ace.xml", Path("/x/ace.xml"))):
        (tmp_path / "camera.toml").write_text(f'feature_file = "{named}"')
        assert load_settings(tmp_path).feature_file == expected


def test_the_operators_page_shows_a_whole_file_of_all_keys() -> None:
    shown = re.search(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert shown is not None
    keys = {line.lstrip("# ").split(" ")[0] for line in shown[1].splitlines() if " = " in line}
    assert keys == {field.name for field in fields(HeadSettings)}
    parsed(shown[1])
