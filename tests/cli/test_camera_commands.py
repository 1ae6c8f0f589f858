"""`fieldcam camera list` and `camera features`, with emulated cameras plugged in."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import emulated_camera.camera
import pytest
import usb.core
from emulated_camera.bus import UsbBus
from emulated_camera.control import ControlChannel, Reply
from emulated_camera.descriptors import Speed
from emulated_camera.faults import ALWAYS, Fault
from emulated_camera.pictures import gradients
from emulated_camera.plugged_bus import PluggedBus
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import LEFT_SERIAL, RIGHT_SERIAL, Shape, StereoHead, stereo_head
from register_files import HEAD

from fieldcam.camera.usb3vision import holders
from fieldcam.camera.usb3vision.usb_faults import UDEV_RULE
from fieldcam.cli import doctor, main
from fieldcam.cli.cameras.features import feature_lines
from fieldcam.errors import ExitCode

HERE = Path(__file__).parents[1]
Capture = pytest.CaptureFixture[str]


def run(capsys: Capture, *words: object) -> tuple[int, str, str]:
    code = main(["camera", *map(str, words)])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def listed(capsys: Capture) -> list[dict[str, Any]]:
    code, out, _ = run(capsys, "list", "--json")
    assert code == ExitCode.OK
    found: list[dict[str, Any]] = json.loads(out)["cameras"]
    return found


def test_cameras_are_listed_with_their_ports(capsys: Capture, stereo_cameras: StereoHead) -> None:
    left, right = listed(capsys)
    assert (left["serial"], right["serial"]) == (LEFT_SERIAL, RIGHT_SERIAL)
    assert (left["port"], left["usb3"], left["power_ma"]) == ("2-1", True, 896)
    assert left["trouble"] is None and left["guid"] != right["guid"]
    _, out, _ = run(capsys, "list")
    assert f"Flash Eye 1440 {LEFT_SERIAL}\n" in out and "896 mA" in out and "slow" not in out


def test_a_usb_2_port_is_warned_of(capsys: Capture, stereo_cameras: StereoHead) -> None:
    stereo_cameras.plug(Speed.HIGH)
    assert [(c["usb3"], c["power_ma"]) for c in listed(capsys)] == [(False, 500)] * 2
    assert "slow" in run(capsys, "list")[1]


def test_no_camera_is_an_empty_list(capsys: Capture, usb_bus: UsbBus) -> None:
    assert listed(capsys) == []
    code, out, err = run(capsys, "list")
    assert (code, out.strip()) == (ExitCode.OK, "No USB3 Vision camera is attached.")
    assert "camera probe" in err


def test_a_forbidden_camera_is_listed_with_the_udev_rule(capsys: Capture, usb_bus: UsbBus) -> None:
    head = stereo_head(usb_bus, Shape.SIDE_BY_SIDE, gradients(64, 48), Sensor(width_px=64))
    usb_bus.plug(head.cameras[0], permitted=False)
    (camera,) = listed(capsys)
    assert camera["serial"] == "" and UDEV_RULE in camera["trouble"]["hint"]
    assert UDEV_RULE in run(capsys, "list")[1]
    for choice in ((), ("--serial", LEFT_SERIAL)):
        code, _, err = run(capsys, "features", *choice)
        assert code == ExitCode.DEVICE and UDEV_RULE in err


def test_who_holds_a_camera_is_named(
    capsys: Capture, stereo_cameras: StereoHead, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(holders, "holder_of", lambda *_: "viewer (process 20)")
    assert [camera["held_by"] for camera in listed(capsys)] == ["viewer (process 20)"] * 2
    assert "by viewer (process 20)" in run(capsys, "list")[1]


def test_what_would_command_the_terminal_is_not_printed(capsys: Capture, usb_bus: UsbBus) -> None:
    head = stereo_head(usb_bus, Shape.TWO_DEVICES, gradients(64, 48), Sensor(width_px=64))
    object.__setattr__(head.cameras[0].identity, "model", "\x1b[31mRed")
    head.plug()
    assert "?[31mRed" in run(capsys, "list")[1]


def test_features_have_the_cameras_own_values(capsys: Capture, stereo_cameras: StereoHead) -> None:
    stereo_cameras.cameras[1].settings.register("ExposureTime").real = 321.5
    code, out, _ = run(capsys, "features", "--serial", RIGHT_SERIAL, "--json")
    features = {feature["name"]: feature for feature in json.loads(out)["features"]}
    assert code == ExitCode.OK
    assert features["DeviceSerialNumber"]["value"] == RIGHT_SERIAL
    exposure = features["ExposureTime"]
    assert (exposure["value"], exposure["unit"], exposure["access"]) == (321.5, "us", "RW")
    assert features["OffsetX"]["max"] == 64 - 8
    assert (features["ChunkGain"]["access"], "value" in features["ChunkGain"]) == ("NA", False)
    _, out, _ = run(capsys, "features", "--serial", RIGHT_SERIAL)
    assert "= 321.5 us (20 to 200000)" in out and "Off, On = Off" in out


def test_long_values_are_folded_at_a_terminal() -> None:
    entries: list[dict[str, Any]] = [
        {"name": "A", "depth": 0, "type": "category", "access": "RO"},
        {
            "name": "B",
            "depth": 1,
            "type": "string",
            "access": "RO",
            "value": "word " * 9 + "x" * 50,
        },
    ]
    narrow, wide = feature_lines(entries, width=60), feature_lines(entries)
    assert max(map(len, narrow)) <= 60 and len(wide) == 3 and len(narrow) > 4
    assert "".join(narrow[2:]).replace(" ", "") == wide[2].replace(" ", "")
    assert {len(line) - len(line.lstrip()) for line in narrow[3:]} == {wide[0].index("values")}


@pytest.mark.parametrize("bits", [b"\xff" * 8, b"\0\0\0\0\0\0\xf0\x7f"])
def test_a_value_that_is_no_number_is_left_out(
    capsys: Capture, stereo_cameras: StereoHead, bits: bytes
) -> None:
    stereo_cameras.cameras[0].settings.register("ExposureTime").data[:] = bits
    code, out, _ = run(capsys, "features", "--serial", LEFT_SERIAL, "--json")
    (value,) = [f["value"] for f in json.loads(out)["features"] if f["name"] == "ExposureTime"]
    assert (code, value) == (ExitCode.OK, None)


@pytest.mark.parametrize(
    ("choice", "code", "words"),
    [
        ((), ExitCode.BAD_INPUT, f"{LEFT_SERIAL}, {RIGHT_SERIAL}"),
        (("--serial", "X-9"), ExitCode.DEVICE, "No camera X-9"),
        (("--serial", LEFT_SERIAL, "--xml", "a.xml"), ExitCode.BAD_INPUT, "not allowed with"),
    ],
)
def test_the_camera_meant_must_be_told(
    capsys: Capture, stereo_cameras: StereoHead, choice: tuple[str, ...], code: ExitCode, words: str
) -> None:
    found, _, err = run(capsys, "features", *choice)
    assert found == code and words in err


def test_without_a_camera_features_say_so(capsys: Capture, usb_bus: UsbBus) -> None:
    code, out, err = run(capsys, "features")
    assert (code, out) == (ExitCode.DEVICE, "") and "No USB3 Vision camera" in err


@pytest.mark.parametrize("xml", [b"<a", b"<a/>", b""])
def test_a_camera_that_describes_itself_wrongly_is_at_fault(
    capsys: Capture, usb_bus: UsbBus, monkeypatch: pytest.MonkeyPatch, xml: bytes
) -> None:
    monkeypatch.setattr(emulated_camera.camera, "description", lambda *_: xml)
    stereo_head(usb_bus, Shape.SIDE_BY_SIDE, gradients(64, 48), Sensor(width_px=64)).plug()
    code, out, err = run(capsys, "features")
    assert (code, out) == (ExitCode.DEVICE, "") and "maker" in err


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda head: head.cameras[0].faults.arm(Fault.IN_USE, ALWAYS), "holds the camera"),
        (lambda head: head.cameras[0].faults.arm(Fault.NO_ACK, ALWAYS), "answered none of"),
    ],
)
def test_features_of_a_camera_in_trouble_end_in_one_sentence(
    capsys: Capture, stereo_cameras: StereoHead, spoil: Callable[[StereoHead], None], words: str
) -> None:
    spoil(stereo_cameras)
    code, out, err = run(capsys, "features", "--serial", LEFT_SERIAL)
    assert (code, out) == (ExitCode.DEVICE, "") and words in err


def test_a_camera_pulled_while_it_is_read_is_gone(
    capsys: Capture, stereo_cameras: StereoHead, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer, asked = ControlChannel.answer, iter(range(1000))

    def pulled(channel: ControlChannel, data: bytes) -> list[Reply]:
        if next(asked) == 60:
            stereo_cameras.unplug()
        return answer(channel, data)

    monkeypatch.setattr(ControlChannel, "answer", pulled)
    code, out, err = run(capsys, "features", "--serial", LEFT_SERIAL)
    assert (code, out) == (ExitCode.DEVICE, "") and "The camera is gone" in err


def checked() -> list[tuple[str, str]]:
    """Health and text of what the doctor says of cameras."""
    return [(check.health, check.text) for check in doctor._cameras()]


def test_the_doctor_looks_at_each_camera(usb_bus: UsbBus) -> None:
    ((health, text),) = checked()
    assert health == "warning" and "none is attached" in text
    head = stereo_head(usb_bus, Shape.TWO_DEVICES, gradients(64, 48), Sensor(width_px=64))
    left, right = head.cameras
    usb_bus.plug(left)
    usb_bus.plug(right, permitted=False)
    (_, good), (_, bad) = sorted(checked(), reverse=True)
    assert f"{LEFT_SERIAL}: USB 3" in good and UDEV_RULE in bad
    head.plug(Speed.HIGH)
    assert [health for health, _ in checked()] == ["warning"] * 2


def test_the_doctor_misses_libusb(monkeypatch: pytest.MonkeyPatch) -> None:
    def find(**_: object) -> None:
        raise usb.core.NoBackendError("No backend available")

    monkeypatch.setattr(usb.core, "find", find)
    ((health, text),) = checked()
    assert health == "warning" and "libusb-1.0-0" in text


def test_without_libusb_the_commands_say_what_to_install(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def find(**_: object) -> None:
        raise usb.core.NoBackendError("No backend available")

    monkeypatch.setattr(usb.core, "find", find)
    for action in ("list", "features"):
        code, out, err = run(capsys, action)
        assert (code, out) == (ExitCode.DEVICE, "") and "libusb-1.0-0" in err


def test_a_letter_that_the_terminal_lacks_is_replaced(tmp_path: Path) -> None:
    head = HEAD.replace("Made", "Made µ")
    exposure = '<Float Name="Exposure"><Value>1.5</Value><Unit>µs</Unit></Float>'
    root = '<Category Name="Root"><pFeature>Exposure</pFeature></Category>'
    (tmp_path / "a.xml").write_text(f"{head}{root}{exposure}</RegisterDescription>", "utf-8")
    command = [sys.executable, "-m", "fieldcam", "camera", "features", "--xml", "a.xml"]
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONPATH": str(HERE.parent)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True)
    assert done.returncode == ExitCode.OK and b"= 1.5 ?s" in done.stdout


def test_the_installed_command_lists_over_libusb(served_bus: PluggedBus) -> None:
    head = stereo_head(served_bus.bus, Shape.TWO_DEVICES, gradients(64, 48), Sensor(width_px=64))
    head.plug()
    ask = partial(subprocess.run, env=served_bus.environment, capture_output=True, text=True)
    command = [sys.executable, "-m", "fieldcam", "camera"]
    done = ask([*command, "list", "--json"])
    assert [c["serial"] for c in json.loads(done.stdout)["cameras"]] == [LEFT_SERIAL, RIGHT_SERIAL]
    done = ask([*command, "features", "--serial", LEFT_SERIAL])
    assert done.returncode == ExitCode.OK and f"= {LEFT_SERIAL}" in done.stdout
