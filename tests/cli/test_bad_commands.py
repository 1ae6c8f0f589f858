"""Every bad input of a command ends in one sentence."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from called_commands import CAMERA_INFO, HEIGHT, WIDTH, Capture, assert_one_sentence, run

from fieldcam.errors import ExitCode

pytestmark = pytest.mark.usefixtures("own_folders")


def blank(path: Path, shape: tuple[int, ...], dtype: type = np.uint8) -> None:
    cv2.imwrite(str(path), np.zeros(shape, dtype))


def replace_by_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def cut_in_half(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def describe_camera(path: Path, tx: object, width: int = WIDTH) -> None:
    path.write_text(CAMERA_INFO.format(width=width, height=HEIGHT, tx=tx))


Spoil = Callable[[Path, Path, Path], object]
BAD_PAIRS: dict[str, Spoil] = {
    "missing image": lambda left, right, calibration: left.unlink(),
    "empty image": lambda left, right, calibration: left.write_bytes(b""),
    "truncated image": lambda left, right, calibration: cut_in_half(right),
    "no image": lambda left, right, calibration: left.write_text("not a picture"),
    "16 bits": lambda left, right, calibration: blank(left, (HEIGHT, WIDTH), np.uint16),
    "sizes differ": lambda left, right, calibration: blank(right, (HEIGHT, WIDTH - 2, 3)),
    "another camera's": lambda left, right, calibration: describe_camera(calibration, -45.6, 1440),
    "folder for an image": lambda left, right, calibration: replace_by_folder(left),
    "folder for a calibration": lambda left, right, calibration: replace_by_folder(calibration),
    "missing calibration": lambda left, right, calibration: calibration.unlink(),
    "empty calibration": lambda left, right, calibration: calibration.write_text(""),
    "truncated calibration": lambda left, right, calibration: cut_in_half(calibration),
    "binary calibration": lambda left, right, calibration: calibration.write_bytes(bytes(256)),
    "no baseline": lambda left, right, calibration: describe_camera(calibration, 0.0),
    "NaN baseline": lambda left, right, calibration: describe_camera(calibration, ".nan"),
    "swapped eyes": lambda left, right, calibration: describe_camera(calibration, 45.6),
    "millimetres": lambda left, right, calibration: describe_camera(calibration, -45600.0),
}


@pytest.mark.parametrize("spoil", BAD_PAIRS.values(), ids=BAD_PAIRS)
def test_bad_pairs_end_in_one_sentence(
    capsys: Capture, pair: tuple[Path, Path, Path], data: Path, spoil: Spoil
) -> None:
    spoil(*pair)
    left, right, calibration = pair
    code, out, err = run(
        capsys, "size", left, right, "--calibration", calibration, "--data", data, "--json"
    )
    assert_one_sentence(code, out, err, ExitCode.BAD_INPUT)


@pytest.mark.parametrize(
    "argv",
    [
        ["nonsense"],
        ["size"],
        ["size", "a", "b"],
        ["size", "a", "b", "--calibration", "c", "--method", "magic"],
        ["size", "a", "b", "--calibration", "c", "--stereo", "magic"],
        ["size", "a", "b", "--calibration", "c", "--expect", "-1"],
        ["size", "a", "b", "--calibration", "c", "--tag", "seventeen"],
        ["size", "a", "b", "--calibration", "c", "--tag-size-mm", "0"],
        ["size", "a", "b", "--calibration", "c", "--tag-size-mm", "nan"],
        ["tags", "a", "b"],
        ["disparity", "a", "b"],
        ["disparity", "a", "b", "c", "--max-disparity", "0"],
        ["disparity", "a", "b", "c", "--max-disparity", "9" * 30],
        ["demo", "--days", "2,0"],
        ["demo", "--days", ""],
        ["demo", "--clusters", "0"],
        ["models"],
        ["models", "add", "magic", "file"],
    ],
    ids=" ".join,
)
def test_wrong_usage_ends_in_one_sentence(capsys: Capture, argv: list[str]) -> None:
    assert_one_sentence(*run(capsys, *argv), ExitCode.BAD_INPUT)


def test_a_changed_network_is_refused(
    capsys: Capture, pair: tuple[Path, Path, Path], data: Path
) -> None:
    (data / "models/net.onnx").write_bytes(b"another network")
    left, right, calibration = pair
    sized = run(capsys, "size", left, right, "--calibration", calibration, "--data", data)
    assert_one_sentence(*sized, ExitCode.BAD_INPUT)
    assert "SHA-256" in sized[2]
    assert_one_sentence(*run(capsys, "segment", left, "--data", data), ExitCode.BAD_INPUT)
    code, out, _ = run(capsys, "models", "verify", "--json", "--data", data)
    assert code == ExitCode.BAD_INPUT
    assert json.loads(out)["ok"] is False


def test_a_network_that_cannot_be_run_is_refused(
    capsys: Capture, pair: tuple[Path, Path, Path], data: Path
) -> None:
    assert_one_sentence(*without_narration(run(capsys, "segment", pair[0], "--data", data)))


def without_narration(result: tuple[int, str, str]) -> tuple[int, str, str, ExitCode]:
    code, out, err = result
    return code, out, err.splitlines(keepends=True)[-1], ExitCode.BAD_INPUT


def test_a_defect_is_logged_and_ends_in_one_sentence(
    capsys: Capture, tmp_path: Path, pair: tuple[Path, Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr("fieldcam.vision.tags.detection.detect_tags", fail)
    assert_one_sentence(*run(capsys, "tags", pair[0]), ExitCode.DEFECT)
    log = (tmp_path / "xdg-state/fieldcam/fieldcam.log").read_text()
    assert "Traceback" in log and "a bug" in log
