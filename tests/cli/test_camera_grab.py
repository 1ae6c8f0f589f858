"""`fieldcam camera grab`: pairs from any stereo head into a folder that `import` reads."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

import cv2
import numpy as np
import pytest
from emulated_camera.pictures import gradients
from emulated_camera.plugged_bus import PluggedBus
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import LEFT_SERIAL, RIGHT_SERIAL, Shape, stereo_head

from fieldcam.camera import finding
from fieldcam.camera.preview import Preview
from fieldcam.cli import main
from fieldcam.disk.durable import write_durably
from fieldcam.errors import (
    CameraUnplugged,
    CaptureTimeout,
    DeviceError,
    ExitCode,
    StorageFull,
)
from fieldcam.exchange.capture_folder import read_capture_folder
from fieldcam.exchange.images import read_pair
from fieldcam.values import Calibration, ImageU8, PixelFormat, RawPair

Capture = pytest.CaptureFixture[str]
NOON = datetime(2026, 5, 3, 12, tzinfo=UTC)


def taken(ordinal: int, left: int = 60, right: int = 50) -> RawPair:
    """A pair in which green is brighter than red and blue."""
    mosaic = np.tile(np.array([[0, 1], [1, 0]], np.uint8) * 40, (8, 12))
    return RawPair(
        left=mosaic + np.uint8(left),
        right=mosaic + np.uint8(right),
        pixel_format=PixelFormat.BAYER_RG8,
        taken_at=NOON,
        left_timestamp_ns=1_000 + ordinal,
        right_timestamp_ns=2_000 + ordinal,
        left_serial="L-1",
        right_serial="R-2",
        trigger_ordinal=ordinal,
    )


class ScriptedHead:
    """A stereo head that gives these pairs, or fails as told."""

    serials = ("L-1", "R-2")
    calibration: Calibration | None = None
    notes = ("R-2 is in a USB 2 port.",)

    def __init__(self, *outcomes: RawPair | DeviceError) -> None:
        self._outcomes = deque(outcomes)
        self.closed = False

    def capture(self, deadline_s: float) -> RawPair:
        assert deadline_s > 0
        outcome = self._outcomes.popleft()
        if isinstance(outcome, DeviceError):
            raise outcome
        return outcome

    def preview(self, deadline_s: float) -> Preview | None:
        raise AssertionError

    def attend(self) -> None:
        """It is always there."""

    def watch_shutter(self, pressed: Callable[[], None]) -> None:
        raise AssertionError

    def close(self) -> None:
        self.closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


Plug = Callable[..., ScriptedHead]


@pytest.fixture
def plug(monkeypatch: pytest.MonkeyPatch) -> Plug:
    def plug(*outcomes: RawPair | DeviceError) -> ScriptedHead:
        head = ScriptedHead(*outcomes)
        monkeypatch.setattr(finding, "open_camera", lambda data: head)
        return head

    return plug


def run(capsys: Capture, *words: object) -> tuple[int, str, str]:
    code = main(["camera", "grab", *map(str, words)])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def test_pairs_are_written_as_import_reads_them(
    capsys: Capture, tmp_path: Path, plug: Plug
) -> None:
    head = plug(taken(1), taken(2, left=255 - 40))
    out = tmp_path / "new" / "captures"
    code, printed, _ = run(capsys, out, "--count", 2, "--tag", 17, "--json")
    document = json.loads(printed)
    captures = read_capture_folder(out).captures
    assert code == ExitCode.OK and head.closed
    assert [(c.tag_id, c.view, c.day.isoformat()) for c in captures] == [
        (17, 1, "2026-05-03"),
        (17, 2, "2026-05-03"),
    ]
    assert [pair["left"] for pair in document["pairs"]] == [str(c.left) for c in captures]
    assert document["serials"] == {"left": "L-1", "right": "R-2"}
    assert (document["size_px"], document["pixel_format"]) == ([24, 16], "bayer_rg8")
    light = document["pairs"][1]["light"]
    assert light["left"] == {"mean": 235.0, "clipped_fraction": 0.5}
    assert light["right"] == {"mean": 70.0, "clipped_fraction": 0.0}
    left, right = read_pair(captures[0].left, captures[0].right)
    assert left[8, 12].tolist() == [60, 100, 60] and right[8, 12].tolist() == [50, 90, 50]


def test_views_go_on_from_those_that_are_there(capsys: Capture, tmp_path: Path, plug: Plug) -> None:
    for tag in (17, 17, 3):
        plug(taken(1))
        assert run(capsys, tmp_path, "--tag", tag)[0] == ExitCode.OK
    found = [(c.tag_id, c.view) for c in read_capture_folder(tmp_path).captures]
    assert found == [(3, 1), (17, 1), (17, 2)]


def test_a_person_reads_the_light_and_the_times(
    capsys: Capture, tmp_path: Path, plug: Plug
) -> None:
    plug(taken(1))
    code, out, err = run(capsys, tmp_path)
    assert code == ExitCode.OK
    assert "left eye L-1, right eye R-2: 24 x 16 pixels each" in out
    assert out.splitlines()[-1].split()[0] == "2026-05-03/0_1_left.png"
    assert "80.0" in out and "70.0" in out and "calibration.yml" in err
    assert "R-2 is in a USB 2 port.\n" in err
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.parametrize("form", [(), ("--json",)])
def test_what_was_taken_before_the_plug_was_pulled_is_told(
    capsys: Capture, tmp_path: Path, plug: Plug, form: tuple[str, ...]
) -> None:
    head = plug(taken(1), CameraUnplugged("The camera is gone.", "Check its cable."))
    code, out, err = run(capsys, tmp_path, "--count", 5, *form)
    assert code == ExitCode.DEVICE and head.closed
    assert "0_1_left.png" in out and "The camera is gone." in err
    assert len(read_capture_folder(tmp_path).captures) == 1
    if form:
        assert json.loads(out)["problem"] == "The camera is gone."


def test_a_camera_that_gives_nothing_leaves_nothing(
    capsys: Capture, tmp_path: Path, plug: Plug
) -> None:
    plug(CaptureTimeout("The camera sent no picture within 5 s."))
    code, out, err = run(capsys, tmp_path / "out")
    assert (code, out) == (ExitCode.DEVICE, "") and "no picture" in err
    assert list(tmp_path.iterdir()) == []


SCENE = np.random.default_rng(3).integers(0, 255, (60, 100), np.uint8)
WIDE = np.asarray(cv2.resize(SCENE, (640, 384), interpolation=cv2.INTER_CUBIC), np.uint8)
"""Blobs of any grey, some pixels wide."""
NEAR, FAR = WIDE[:, 80:560], WIDE[:, 160:]


@pytest.mark.parametrize(
    ("left", "right", "eyes", "words"),
    [
        (NEAR, FAR, None, ""),
        (FAR, NEAR, "swapped_eyes", "left and right are swapped"),
        (WIDE[:, :320], WIDE[:, 320:], "mispaired", "check `layout`"),
        (np.full_like(NEAR, 90), np.full_like(NEAR, 90), None, ""),
    ],
    ids=["in order", "swapped", "halves of one eye's picture", "nothing to be seen"],
)
def test_the_pictures_tell_left_from_right(
    capsys: Capture, tmp_path: Path, plug: Plug,
    left: ImageU8, right: ImageU8, eyes: str | None, words: str,
) -> None:  # fmt: skip
    pair = replace(taken(1), left=left, right=right, pixel_format=PixelFormat.MONO8)
    plug(pair, pair)
    code, printed, told = run(capsys, tmp_path, "--count", 2, "--json")
    assert code == ExitCode.OK
    assert [each["eyes"] for each in json.loads(printed)["pairs"]] == [eyes, eyes]
    assert told.count("camera.toml") == (eyes is not None) and words in told


def test_another_head_than_the_one_named_is_refused(
    capsys: Capture, tmp_path: Path, plug: Plug
) -> None:
    head = plug(taken(1))
    code, _, err = run(capsys, tmp_path, "--serial", "L-9")
    assert code == ExitCode.DEVICE and "L-1 and R-2, not L-9" in err and head.closed
    assert run(capsys, tmp_path, "--serial", "R-2")[0] == ExitCode.OK


def test_the_head_is_set_up_as_the_data_folder_says(
    capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def open_camera(data: Path) -> ScriptedHead:
        asked.append(data)
        return ScriptedHead(taken(1))

    monkeypatch.setattr(finding, "open_camera", open_camera)
    run(capsys, tmp_path / "out", "--data", tmp_path / "data")
    assert asked == [tmp_path / "data"]


@pytest.mark.parametrize("name", ["file", "file/below", "x" * 300])
def test_a_folder_that_cannot_be_written_is_told_before_the_flash(
    capsys: Capture, tmp_path: Path, plug: Plug, name: str
) -> None:
    (tmp_path / "file").write_text("")
    head = plug(taken(1))
    code, _, err = run(capsys, tmp_path / name)
    assert code == ExitCode.BAD_INPUT and "cannot be written" in err
    assert not head.closed


def test_no_eye_is_left_without_the_other(
    capsys: Capture, tmp_path: Path, plug: Plug, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = write_durably

    def until_full(path: Path, content: bytes) -> None:
        if "right" in path.name:
            raise StorageFull(f"No room is left to write {path}.")
        write(path, content)

    monkeypatch.setattr("fieldcam.session.grabbing.write_durably", until_full)
    plug(taken(1))
    code, out, err = run(capsys, tmp_path)
    assert (code, out) == (ExitCode.STORAGE, "") and "No room" in err
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize(("option", "value"), [("--count", 0), ("--count", "x"), ("--tag", 587)])
def test_nonsense_is_refused(
    capsys: Capture, tmp_path: Path, plug: Plug, option: str, value: object
) -> None:
    plug(taken(1))
    assert run(capsys, tmp_path, option, value)[0] == ExitCode.BAD_INPUT


def test_the_installed_command_grabs_over_libusb(served_bus: PluggedBus, tmp_path: Path) -> None:
    head = stereo_head(
        served_bus.bus, Shape.TWO_DEVICES, gradients(64, 48), Sensor(width_px=64, height_px=48)
    )
    head.plug()
    command = [sys.executable, "-m", "fieldcam", "camera", "grab", str(tmp_path / "out"), "--json"]
    done = subprocess.run(
        [*command, "--count", "2", "--data", str(tmp_path)],
        env=served_bus.environment | {"XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == ExitCode.OK, done.stderr
    document = json.loads(done.stdout)
    assert document["serials"] == {"left": LEFT_SERIAL, "right": RIGHT_SERIAL}
    assert (len(document["pairs"]), head.head.flashes) == (2, 2)
    assert len(read_capture_folder(tmp_path / "out").captures) == 2
