"""The commands on photographs and pairs that nobody here made."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from fieldcam.cli import main
from fieldcam.exchange.images import read_image

pytestmark = pytest.mark.usefixtures("no_user_folders")


@pytest.fixture
def no_user_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FIELDCAM_DATA", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    cv2.setNumThreads(1)


def document(capsys: pytest.CaptureFixture[str], *argv: object) -> dict[str, Any]:
    assert main([*map(str, argv), "--json"]) == 0
    printed: dict[str, Any] = json.loads(capsys.readouterr().out)
    return printed


@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("33369213973_9d9bb4cc96_c", 8),
        ("34085369442_304b6bafd9_c", 20),
        ("34139872896_defdb2f8d9_c", 8),
    ],
)
def test_tags_of_a_photograph(
    capsys: pytest.CaptureFixture[str], real: Path, name: str, least: int
) -> None:
    photograph = real / "apriltag" / "nasa_swarmathon" / f"{name}.jpg"
    tags = document(capsys, "tags", photograph)["tags"]
    height, width = read_image(photograph).shape[:2]
    assert len(tags) >= least
    for tag in tags:
        corners = np.array(tag["corners_px"])
        assert (tag["id"], tag["range_mm"]) == (0, None)
        assert corners.shape == (4, 2)
        assert (corners > 0).all() and (corners < (width, height)).all()
        assert np.hypot(*(corners.mean(axis=0) - tag["center_px"])) < 2


def test_apples_of_a_photograph(capsys: pytest.CaptureFixture[str], real: Path) -> None:
    photograph = real / "apples_green" / "images" / "DSC_1060_17kv10r17k_3.jpg"
    instances = document(capsys, "segment", photograph)["instances"]
    assert instances
    assert [i["score"] for i in instances] == sorted((i["score"] for i in instances), reverse=True)
    for instance in instances:
        x0, y0, x1, y1 = instance["box_px"]
        outline = np.array(instance["outline_px"])
        assert 0 <= x0 < x1 <= 640 and 0 <= y0 < y1 <= 640
        assert outline.ndim == 2 and outline.shape[1] == 2
        assert 0 < instance["area_px"] <= 640 * 640
        # The outline belongs to the box, give or take what the network disagrees with itself.
        middle = outline.mean(axis=0)
        assert x0 - 5 < middle[0] < x1 + 5 and y0 - 5 < middle[1] < y1 + 5


@pytest.mark.parametrize("matcher", ["raft", "sgbm"])
def test_disparity_of_a_pair(
    capsys: pytest.CaptureFixture[str], real: Path, tmp_path: Path, matcher: str
) -> None:
    folder, out = real / "stereo" / "middlebury2003_Teddy", tmp_path / "disparity.npy"
    said = document(
        capsys, "disparity", folder / "im2.png", folder / "im6.png", out,
        "--stereo", matcher, "--max-disparity", 64,
    )  # fmt: skip
    disparity = np.load(out)
    assert disparity.dtype == np.float32
    assert disparity.shape == read_image(folder / "im2.png").shape[:2]
    assert said["known_share"] == pytest.approx(np.isfinite(disparity).mean())
    assert 0.5 < said["known_share"] < 1
    assert np.nanmin(disparity) > 0 and np.nanmax(disparity) <= 64
