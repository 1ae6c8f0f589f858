"""The commands print what the contract says."""

from __future__ import annotations

import json
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from called_commands import Capture, FakePipeline, assert_one_sentence, run

from fieldcam.cli import doctor
from fieldcam.errors import ExitCode
from fieldcam.exchange.images import read_image
from fieldcam.models import SHIPPED_NETWORKS, find_models
from fieldcam.store.clock import Moment
from fieldcam.values import (
    Expectation,
    Matcher,
    Method,
    Settings,
)

pytestmark = pytest.mark.usefixtures("own_folders")


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


def test_the_doctor_doubts_a_clock_that_has_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    assert doctor._clock().health is doctor.Health.GOOD
    flat = Moment(datetime(2000, 1, 1, 9, tzinfo=UTC), 0, "boot", 1)
    monkeypatch.setattr("fieldcam.store.clock.now", lambda: flat)
    found = doctor._clock()
    assert found.health is doctor.Health.WARNING and "before this version" in found.text


def test_the_doctors_drawn_pair_holds_its_tag_in_both_eyes() -> None:
    from fieldcam.cli.self_test import CAMERA, RANGE_MM, TAG_ID, drawn_pair
    from fieldcam.vision.tags.detection import detect_tags

    drawn = drawn_pair()
    left, right = (detect_tags(eye, CAMERA) for eye in (drawn.left, drawn.right))
    assert [t.id for t in left] == [t.id for t in right] == [TAG_ID]
    assert left[0].range_mm == pytest.approx(RANGE_MM, rel=0.01)
    shift = left[0].center_px[0] - right[0].center_px[0]
    assert shift == pytest.approx(CAMERA.disparity_px(RANGE_MM), abs=1)


def test_the_installed_command_gives_its_exit_status() -> None:
    command = [sys.executable, "-c", "from fieldcam.cli import entry_point; entry_point()"]
    done = subprocess.run([*command, "tags", "missing.png"], capture_output=True, text=True)
    assert done.returncode == ExitCode.BAD_INPUT
    assert done.stderr == "fieldcam: There is no image missing.png.\n"


def test_the_sentence_about_the_networks_says_rendered() -> None:
    assert "masks and flash light were rendered" in SHIPPED_NETWORKS
