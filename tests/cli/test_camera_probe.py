"""`fieldcam camera probe`: whatever a camera tells, and whatever it refuses."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import emulated_camera.camera
import pytest
import usb.core
from emulated_camera import descriptors as sent
from emulated_camera.bootstrap import EIRM, MANIFEST, SBRM, SIRM
from emulated_camera.bus import UsbBus
from emulated_camera.control import ControlChannel, Reply
from emulated_camera.descriptors import Speed
from emulated_camera.faults import ALWAYS, Fault
from emulated_camera.pictures import gradients
from emulated_camera.protocol import Status
from emulated_camera.registers import AddressSpace, Refused
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import LEFT_SERIAL, RIGHT_SERIAL, Shape, StereoHead, stereo_head
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldcam.camera.usb3vision.descriptor_text import (
    describe_descriptors,
    interface_classes,
    split_descriptors,
)
from fieldcam.camera.usb3vision.register_blocks import read_blocks
from fieldcam.camera.usb3vision.survey import libusb_version, survey_bus
from fieldcam.camera.usb3vision.usb_faults import UDEV_RULE
from fieldcam.cli import main
from fieldcam.errors import CameraRefused, ExitCode

Capture = pytest.CaptureFixture[str]


def run(capsys: Capture, *words: object) -> tuple[int, str, str]:
    code = main(["camera", "probe", *map(str, words)])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def probed(capsys: Capture, *words: object) -> dict[str, Any]:
    code, out, _ = run(capsys, "--json", *words)
    assert code == ExitCode.OK
    found: dict[str, Any] = json.loads(out)
    return found


def test_a_camera_tells_all_about_itself(capsys: Capture, stereo_cameras: StereoHead) -> None:
    found = probed(capsys)
    assert [camera["serial"] for camera in found["cameras"]] == [LEFT_SERIAL, RIGHT_SERIAL]
    left = found["cameras"][0]
    registers = {(each["block"], each["name"]): each for each in left["registers"]}
    assert {block for block, _ in registers} == {"ABRM", "SBRM", "SIRM", "EIRM"}
    assert not [each for each in left["registers"] if each["problem"] or not each["content"]]
    sbrm = registers["ABRM", "SBRM address"]
    assert int.from_bytes(bytes.fromhex(sbrm["content"]), "little") == SBRM
    assert registers["SIRM", "required payload size"]["address"] == SIRM + 8
    assert left["manifest"][0]["schema_version"] == [1, 1]
    assert {"ExposureTime", "TriggerSource"} <= {each["name"] for each in left["features"]}
    assert left["problems"] == []


def test_a_person_reads_the_same(capsys: Capture, stereo_cameras: StereoHead) -> None:
    code, out, err = run(capsys, "--serial", RIGHT_SERIAL)
    assert code == ExitCode.OK
    assert out.count("interface 0.0: class ef/05/00, 2 endpoints") == 2
    assert "endpoint 83 IN: bulk, wMaxPacketSize 1024" in out
    assert "companion: bMaxBurst 15" in out and "14 24 01" in out
    assert f"serial number                        {RIGHT_SERIAL}" in out
    assert "= 500 us (20 to 200000)" in out
    assert f"serial number                        {LEFT_SERIAL}" not in out
    assert "Asking the camera in USB socket 2-2." in err


@pytest.mark.parametrize("speed", list(Speed))
def test_descriptors_are_those_that_the_camera_sends(
    stereo_cameras: StereoHead, speed: Speed
) -> None:
    stereo_cameras.plug(speed)
    for device, camera in zip(survey_bus().candidates, stereo_cameras.cameras, strict=True):
        identity = camera.identity
        plain = sent.device(identity, speed) + sent.configuration(identity, speed)
        assert (device.descriptors, device.object_store) == (plain, sent.binary_object_store())
        assert (device.port[0], device.names[2]) == (
            str(2 - (not device.speed.is_usb3)),
            identity.serial,
        )


@pytest.mark.parametrize(("usb_class", "found"), [(0xFF, 2), (0x0E, 2), (3, 0), (9, 0)])
def test_a_device_of_an_unknown_kind_is_told_but_no_keyboard(
    capsys: Capture,
    stereo_cameras: StereoHead,
    monkeypatch: pytest.MonkeyPatch,
    usb_class: int,
    found: int,
) -> None:
    monkeypatch.setattr(sent, "_MISCELLANEOUS", usb_class)
    document = probed(capsys)
    assert (len(document["devices"]), document["left_out"]) == (found, 2 - found)
    assert document["cameras"] == []
    out = run(capsys)[1]
    assert f"{found} USB devices could be a camera; {2 - found} others cannot" in out
    assert ("EMU-LEFT-01" in out) == bool(found)


def test_no_device_at_all_is_told(capsys: Capture, usb_bus: UsbBus) -> None:
    code, out, _ = run(capsys)
    assert code == ExitCode.OK and out.startswith("0 USB devices could be a camera")


@pytest.mark.parametrize("refused", [0x004, 0x1CC, 0x1F0, SBRM, SBRM + 0x40, SIRM, EIRM, MANIFEST])
def test_what_a_camera_refuses_does_not_hide_the_rest(
    capsys: Capture, stereo_cameras: StereoHead, monkeypatch: pytest.MonkeyPatch, refused: int
) -> None:
    read = AddressSpace.read

    def refusing(space: AddressSpace, address: int, count: int) -> bytes:
        if address <= refused < address + count:
            raise Refused(Status.ACCESS_DENIED)
        return read(space, address, count)

    monkeypatch.setattr(AddressSpace, "read", refusing)
    (camera,) = probed(capsys, "--serial", LEFT_SERIAL)["cameras"]
    refusals = [each["problem"] for each in camera["registers"] if each["problem"]]
    assert all("access denied" in problem for problem in [*refusals, *camera["problems"]])
    assert len(refusals) == (refused != MANIFEST)
    assert {each["block"] for each in camera["registers"]} >= {"ABRM", "SBRM", "SIRM", "EIRM"}
    assert run(capsys)[0] == ExitCode.OK


def test_a_camera_without_an_answer_still_has_descriptors(
    capsys: Capture, stereo_cameras: StereoHead
) -> None:
    stereo_cameras.cameras[0].faults.arm(Fault.NO_ACK, ALWAYS)
    found = probed(capsys)
    assert found["cameras"][0]["registers"] == []
    assert "answered none of" in found["cameras"][0]["problems"][0]
    assert len(found["devices"]) == 2 and len(found["cameras"][1]["features"]) > 50


@pytest.mark.parametrize("commands", [0, 1, 7, 30, 60, 110])
def test_a_camera_pulled_in_the_middle_leaves_what_it_told(
    capsys: Capture,
    stereo_cameras: StereoHead,
    monkeypatch: pytest.MonkeyPatch,
    commands: int,
) -> None:
    answer, asked = ControlChannel.answer, iter(range(10_000))

    def pulled(channel: ControlChannel, data: bytes) -> list[Reply]:
        if next(asked) == commands:
            stereo_cameras.unplug()
        return answer(channel, data)

    monkeypatch.setattr(ControlChannel, "answer", pulled)
    (camera,) = probed(capsys, "--serial", LEFT_SERIAL)["cameras"]
    assert camera["problems"][0].startswith("The camera is gone.")
    told = len(camera["registers"]), len(camera["features"])
    assert told[0] == min(commands, 46) and (told[1] > 0) == (commands == 110)


def test_a_camera_in_use_tells_its_descriptors(capsys: Capture, stereo_cameras: StereoHead) -> None:
    stereo_cameras.cameras[0].faults.arm(Fault.IN_USE, ALWAYS)
    left, right = probed(capsys)["cameras"]
    assert "holds the camera" in left["problems"][0] and right["problems"] == []


def test_a_forbidden_camera_is_told_with_the_udev_rule(capsys: Capture, usb_bus: UsbBus) -> None:
    head = stereo_head(usb_bus, Shape.SIDE_BY_SIDE, gradients(64, 48), Sensor(width_px=64))
    usb_bus.plug(head.cameras[0], permitted=False)
    code, out, _ = run(capsys)
    assert code == ExitCode.OK
    assert "interface 0.0: class ef/05/00" in out and UDEV_RULE in out


@pytest.mark.parametrize("xml", [b"<a", b"", b"<a/>"])
def test_a_broken_feature_file_goes_into_the_bundle_as_it_is(
    capsys: Capture, usb_bus: UsbBus, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, xml: bytes
) -> None:
    monkeypatch.setattr(emulated_camera.camera, "description", lambda *_: xml)
    stereo_head(usb_bus, Shape.SIDE_BY_SIDE, gradients(64, 48), Sensor(width_px=64)).plug()
    (camera,) = probed(capsys, "--out", tmp_path / "b.zip")["cameras"]
    assert len(camera["registers"]) == 46 and len(camera["problems"]) == 1
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        kept = [archive.read(name) for name in archive.namelist() if name.endswith(".xml")]
    assert kept == [xml] * bool(xml)


def test_the_bundle_holds_what_a_driver_is_written_from(
    capsys: Capture, stereo_cameras: StereoHead, tmp_path: Path
) -> None:
    code, out, err = run(capsys, "--out", tmp_path / "bundle.zip")
    assert code == ExitCode.OK and "README.txt" in err and "interface 0.0" in out
    with zipfile.ZipFile(tmp_path / "bundle.zip") as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    identity = stereo_cameras.cameras[0].identity
    assert files["usb/2-1.bin"].startswith(sent.device(identity, Speed.SUPER))
    assert b"<RegisterDescription" in files["cameras/2-1/description.xml"]
    assert b"ExposureTime" in files["cameras/2-2/features.txt"]
    assert b"SBRM address" in files["cameras/2-1/registers.txt"]
    assert b"usbmon" in files["README.txt"] and b"kernel Linux" in files["versions.txt"]
    assert len(json.loads(files["probe.json"])["cameras"]) == 2


@pytest.mark.parametrize("name", ["bundle.tar", "missing/bundle.zip", "folder.zip", "old.zip"])
def test_a_bundle_that_cannot_be_written_is_refused_before_the_work(
    capsys: Capture, stereo_cameras: StereoHead, tmp_path: Path, name: str
) -> None:
    (tmp_path / "folder.zip").mkdir()
    (tmp_path / "old.zip").write_bytes(b"of another head")
    code, out, err = run(capsys, "--out", tmp_path / name)
    assert (code, out) == (ExitCode.BAD_INPUT, "") and str(tmp_path) in err
    assert (tmp_path / "old.zip").read_bytes() == b"of another head"


def test_an_unknown_serial_number_is_told(capsys: Capture, stereo_cameras: StereoHead) -> None:
    code, out, err = run(capsys, "--serial", "X-9")
    assert (code, out) == (ExitCode.DEVICE, "") and "No camera X-9" in err


def test_without_libusb_one_sentence_says_so(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def find(**_: object) -> None:
        raise usb.core.NoBackendError("No backend available")

    monkeypatch.setattr(usb.core, "find", find)
    code, out, err = run(capsys)
    assert (code, out) == (ExitCode.DEVICE, "") and "libusb is not installed" in err


def test_the_version_of_libusb_has_three_parts() -> None:
    assert libusb_version() == "" or len(libusb_version().split(".")) == 3


@given(raw=st.binary(max_size=80))
def test_fuzz_descriptors_are_described_whatever_they_are(raw: bytes) -> None:
    assert b"".join(split_descriptors(raw)) == raw
    lines = list(describe_descriptors(raw))
    assert len(lines) == len(list(split_descriptors(raw)))
    assert all(line.isprintable() for line in lines)
    assert interface_classes(raw) <= set(range(256))


@settings(max_examples=40)
@given(data=st.data())
def test_fuzz_registers_hold_anything_or_are_refused(data: st.DataObject) -> None:
    class Anything:
        def read(self, address: int, length: int) -> bytes:
            if data.draw(st.booleans()):
                raise CameraRefused("No.")
            return data.draw(st.binary(min_size=length, max_size=length))

        def write(self, address: int, data: bytes) -> None:
            raise AssertionError

    found = list(read_blocks(Anything()))
    assert [each.block for each in found[:20]] == ["ABRM"] * 20
    assert all(each.text is not None and bool(each.content) != bool(each.problem) for each in found)


def test_a_bundle_needs_no_camera(capsys: Capture, usb_bus: UsbBus, tmp_path: Path) -> None:
    assert run(capsys, "--out", tmp_path / "empty.zip")[0] == ExitCode.OK
    with zipfile.ZipFile(io.BytesIO((tmp_path / "empty.zip").read_bytes())) as archive:
        assert archive.namelist() == ["README.txt", "versions.txt", "probe.json"]
