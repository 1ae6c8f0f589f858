"""The commands print what the contract says, and every bad input ends in one sentence."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from drawn_tags import tag_cells
from made_readings import made_fruitlet, made_reading

from fieldcam.cli import main
from fieldcam.errors import ExitCode
from fieldcam.exchange.images import read_image
from fieldcam.models import RENDERED_ONLY, find_models
from fieldcam.values import (
    Calibration,
    ClusterReading,
    Expectation,
    Flag,
    Matcher,
    Method,
    Reason,
    ReasonCode,
    Settings,
    Status,
    StereoPair,
    Verdict,
)
from fieldcam.vision.pipeline import Pipeline

WIDTH, HEIGHT = 640, 480
CAMERA_INFO = """\
height: {height}
width: {width}
distortion_model: "plumb_bob"
D: [0.0, 0.0, 0.0, 0.0, 0.0]
K: [760.0, 0.0, 320.0, 0.0, 760.0, 240.0, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [760.0, 0.0, 320.0, {tx}, 0.0, 760.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]
"""
Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is read from or written to the user's own folders."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "xdg-data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "xdg-state"))
    monkeypatch.delenv("FIELDCAM_DATA", raising=False)


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, Path, Path]:
    """Left and right image with tag 17 in them, and their calibration."""
    left = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    card = cv2.resize(tag_cells(17), (96, 96), interpolation=cv2.INTER_NEAREST)
    left[200:296, 300:396] = card[..., None]
    paths = tmp_path / "left.png", tmp_path / "right.png", tmp_path / "calibration.yml"
    cv2.imwrite(str(paths[0]), left)
    cv2.imwrite(str(paths[1]), np.roll(left, -100, axis=1))
    paths[2].write_text(CAMERA_INFO.format(width=WIDTH, height=HEIGHT, tx=-45.6))
    return paths


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A data folder with two networks that can be verified, though not run."""
    folder = tmp_path / "data" / "models"
    folder.mkdir(parents=True)
    content = b"network"
    entry = {"file": "net.onnx", "sha256": sha256(content).hexdigest()}
    (folder / "net.onnx").write_bytes(content)
    manifest = {
        "schema": 1,
        "segmentation": {**entry, "score_threshold": 0.5},
        "stereo": {**entry, "search_px": 32, "multiple": 16, "scale": 0.5},
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder.parent


class FakePipeline:
    """Answers every pair with one reading, and keeps what it was asked."""

    def __init__(self, reading: ClusterReading) -> None:
        self.reading = reading
        self.asked: list[tuple[Expectation | None, Settings | None]] = []

    def analyse(
        self,
        pair: StereoPair,
        calibration: Calibration,
        expectation: Expectation | None = None,
        settings: Settings | None = None,
    ) -> ClusterReading:
        self.asked.append((expectation, settings))
        return self.reading


@pytest.fixture
def pipeline(monkeypatch: pytest.MonkeyPatch) -> FakePipeline:
    reasons = (Reason(ReasonCode.FEWER_THAN_BEFORE, "2 fruitlets where 3 were counted."),)
    reading = made_reading(
        [
            made_fruitlet(0, (300.0, 200.0), 9.13),
            made_fruitlet(1, (330.0, 210.0), None, flags=(Flag.HIDDEN,)),
            made_fruitlet(2, (500.0, 100.0), 7.0, in_target=False, cluster=1),
        ],
        Verdict(Status.CONFIRM, reasons),
    )
    fake = FakePipeline(reading)
    monkeypatch.setattr(Pipeline, "from_models", lambda models: fake)
    return fake


def run(capsys: Capture, *argv: object) -> tuple[int, str, str]:
    code = main([str(each) for each in argv])
    out, err = capsys.readouterr()
    return code, out, err


def assert_one_sentence(code: int, out: str, err: str, expected: ExitCode) -> None:
    assert code == expected
    assert out == ""
    assert err.startswith("fieldcam: ") and err.endswith((".\n", "?\n"))
    assert len(err.splitlines()) == 1 and "Traceback" not in err


def test_size_prints_the_contracts_document(
    capsys: Capture, pair: tuple[Path, Path, Path], data: Path, pipeline: FakePipeline
) -> None:
    left, right, calibration = pair
    code, out, _ = run(
        capsys, "size", left, right, "--calibration", calibration, "--data", data, "--json"
    )
    document = json.loads(out)
    assert code == ExitCode.OK
    assert list(document) == ["tag", "verdict", "fruitlets", "timing_ms", "models"]
    assert document["tag"]["id"] == 17
    assert document["verdict"]["reasons"][0]["code"] == "fewer_than_before"
    sizes = [(f["diameter_mm"], f["in_target"], f["flags"]) for f in document["fruitlets"]]
    assert sizes == [(9.13, True, []), (None, True, ["hidden"]), (7.0, False, [])]


def test_size_hands_on_what_was_asked(
    capsys: Capture, pair: tuple[Path, Path, Path], data: Path, pipeline: FakePipeline
) -> None:
    left, right, calibration = pair
    options = ["--tag", 17, "--expect", 3, "--method", "paper", "--stereo", "sgbm"]
    options += ["--whole-image", "--tag-size-mm", 30.5]
    code, _, _ = run(
        capsys, "--data", data, "size", left, right, "--calibration", calibration, *options
    )
    assert code == ExitCode.OK
    assert pipeline.asked == [
        (Expectation(17, 3), Settings(Method.PAPER, Matcher.SGBM, True, 30.5))
    ]


def test_size_for_people_says_what_the_networks_were_trained_on(
    capsys: Capture, pair: tuple[Path, Path, Path], data: Path, pipeline: FakePipeline
) -> None:
    left, right, calibration = pair
    code, out, _ = run(capsys, "size", left, right, "--calibration", calibration, "--data", data)
    assert code == ExitCode.OK
    assert out.startswith("CONFIRM  tag 17 at 440 mm")
    assert "9.13" in out and "hidden" in out and "1 more outside" in out
    assert "trained" in out or "added by the user" in out


def test_size_writes_the_overlay(
    capsys: Capture,
    tmp_path: Path,
    pair: tuple[Path, Path, Path],
    data: Path,
    pipeline: FakePipeline,
) -> None:
    left, right, calibration = pair
    picture = tmp_path / "overlay.png"
    run(
        capsys, "size", left, right, "--calibration", calibration, "--data", data,
        "--overlay", picture,
    )  # fmt: skip
    assert read_image(picture).shape == (1080, 1440, 3)
    code, out, err = run(
        capsys, "size", left, right, "--calibration", calibration, "--data", data,
        "--overlay", tmp_path / "nowhere" / "overlay.png",
    )  # fmt: skip
    assert_one_sentence(code, out, err, ExitCode.BAD_INPUT)


def test_tags_gives_corners_and_range(capsys: Capture, pair: tuple[Path, Path, Path]) -> None:
    left, _, calibration = pair
    code, out, _ = run(capsys, "tags", left, "--json")
    (tag,) = json.loads(out)["tags"]
    assert code == ExitCode.OK
    assert tag["id"] == 17 and tag["range_mm"] is None
    assert np.array(tag["corners_px"]).shape == (4, 2)
    _, out, _ = run(capsys, "tags", left, "--json", "--calibration", calibration)
    # The tag's side is 64 px, so 27.95 mm lie 27.95 * 760 / 64 mm away.
    assert json.loads(out)["tags"][0]["range_mm"] == pytest.approx(332, abs=4)
    code, out, _ = run(capsys, "tags", left)
    assert code == ExitCode.OK and "17" in out


def test_an_image_without_a_tag_is_an_honest_empty_list(capsys: Capture, tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "black.png"), np.zeros((60, 80, 3), np.uint8))
    code, out, _ = run(capsys, "tags", tmp_path / "black.png", "--json")
    assert code == ExitCode.OK
    assert json.loads(out) == {"tags": []}


def test_disparity_writes_what_it_is_told_where_it_is_told(capsys: Capture, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    wall = cv2.GaussianBlur(rng.integers(0, 256, (96, 240, 3)).astype(np.uint8), (0, 0), 1.5)
    cv2.imwrite(str(tmp_path / "l.png"), wall[:, :200])
    cv2.imwrite(str(tmp_path / "r.png"), wall[:, 12:212])
    out_file = tmp_path / "disparity"
    code, out, _ = run(
        capsys, "disparity", tmp_path / "l.png", tmp_path / "r.png", out_file,
        "--stereo", "sgbm", "--max-disparity", 32,
    )  # fmt: skip
    disparity = np.load(out_file)
    assert code == ExitCode.OK and out == ""
    assert disparity.dtype == np.float32 and disparity.shape == (96, 200)
    assert np.nanmedian(disparity) == pytest.approx(12, abs=0.2)
    assert np.isfinite(disparity[:, 60:180]).mean() > 0.9


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


def test_models_list_verify_and_add(capsys: Capture, tmp_path: Path, data: Path) -> None:
    _, out, _ = run(capsys, "models", "list", "--json", "--data", data)
    assert [m["role"] for m in json.loads(out)["models"]] == ["segmentation", "stereo"]
    code, out, _ = run(capsys, "models", "verify", "--json", "--data", data)
    assert code == ExitCode.OK and json.loads(out)["ok"] is True
    better = tmp_path / "better.onnx"
    better.write_bytes(find_models().stereo.path.read_bytes())
    code, out, _ = run(capsys, "models", "add", "stereo", better, "--json", "--data", data)
    assert code == ExitCode.OK
    _, listed, _ = run(capsys, "models", "list", "--json", "--data", data)
    assert json.loads(out) in json.loads(listed)["models"]


def test_doctor_reports_each_check(capsys: Capture, data: Path, pipeline: FakePipeline) -> None:
    code, out, _ = run(capsys, "doctor", "--json", "--data", data)
    checks: dict[str, Any] = {c["name"]: c for c in json.loads(out)["checks"]}
    assert code == ExitCode.OK
    assert {"machine", "data folder", "disk", "networks", "self-test", "camera"} <= set(checks)
    assert checks["self-test"]["health"] in ("good", "warning")
    (data / "models/net.onnx").write_bytes(b"another network")
    _, out, _ = run(capsys, "doctor", "--json", "--data", data)
    assert json.loads(out)["ok"] is False


def test_the_doctors_drawn_pair_holds_its_tag_in_both_eyes() -> None:
    from fieldcam.cli.self_test import CAMERA, RANGE_MM, TAG_ID, drawn_pair
    from fieldcam.vision.tags import detect_tags

    drawn = drawn_pair()
    left, right = (detect_tags(eye, CAMERA) for eye in (drawn.left, drawn.right))
    assert [t.id for t in left] == [t.id for t in right] == [TAG_ID]
    assert left[0].range_mm == pytest.approx(RANGE_MM, rel=0.01)
    shift = left[0].center_px[0] - right[0].center_px[0]
    assert shift == pytest.approx(CAMERA.disparity_px(RANGE_MM), abs=1)


def test_a_defect_is_logged_and_ends_in_one_sentence(
    capsys: Capture, tmp_path: Path, pair: tuple[Path, Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr("fieldcam.vision.tags.detect_tags", fail)
    assert_one_sentence(*run(capsys, "tags", pair[0]), ExitCode.DEFECT)
    log = (tmp_path / "xdg-state/fieldcam/fieldcam.log").read_text()
    assert "Traceback" in log and "a bug" in log


def test_the_installed_command_gives_its_exit_status() -> None:
    command = [sys.executable, "-c", "from fieldcam.cli import entry_point; entry_point()"]
    done = subprocess.run([*command, "tags", "missing.png"], capture_output=True, text=True)
    assert done.returncode == ExitCode.BAD_INPUT
    assert done.stderr == "fieldcam: There is no image missing.png.\n"


def test_the_sentence_about_the_networks_says_rendered() -> None:
    assert "rendered fruit only" in RENDERED_ONLY
