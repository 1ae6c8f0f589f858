"""Whatever is photographed or handed over, the shipped networks make up no sizes."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from fieldcam.cli import main
from fieldcam.errors import ExitCode
from fieldcam.exchange.images import write_png
from fieldcam.models import SHIPPED_FOLDER, Models, find_models
from fieldcam.values import Calibration, ImageU8, Region, StereoPair
from fieldcam.vision.pipeline import Pipeline

pytest.importorskip("embreex", reason="the simulator extra is not installed")

from fieldcam.simulator import BlockPlan, SimulatedCapture, capture

SMALL = Calibration(640, 480, 760.0, 320.0, 240.0, 60.0)
CAMERA_INFO = """\
height: {c.height_px}
width: {c.width_px}
distortion_model: "plumb_bob"
D: [0.0, 0.0, 0.0, 0.0, 0.0]
K: [{c.focal_px}, 0.0, {c.cx_px}, 0.0, {c.focal_px}, {c.cy_px}, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [{c.focal_px}, 0.0, {c.cx_px}, {shift}, 0.0, {c.focal_px}, {c.cy_px}, 0.0, 0.0, 0.0, 1.0, 0.0]
"""
GREY = 110
CARD_MM = 38.0
"""Side of what is left of the tag's card, white border included."""
FEWEST_OF_60 = 30
Reading = dict[str, Any]
Size = Callable[..., Reading]


@pytest.fixture(autouse=True)
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is read from or written to the user's own folders."""
    monkeypatch.setenv("FIELDCAM_DATA", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture(scope="module")
def shipped() -> Pipeline:
    """The shipped networks, opened once."""
    cv2.setNumThreads(1)
    return Pipeline.from_models(find_models())


@pytest.fixture(scope="module")
def scene() -> SimulatedCapture:
    """A good pair; tests change copies of it."""
    return capture(BlockPlan.plan(6_000_105, 1), 0, 0.0)


@pytest.fixture
def size(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    shipped: Pipeline,
    monkeypatch: pytest.MonkeyPatch,
) -> Size:
    """Writes a pair and runs `fieldcam size --json` on it."""

    def opened(_: Models) -> Pipeline:
        return shipped

    def run(pair: StereoPair, calibration: Calibration, *options: object) -> Reading:
        left, right, camera = (tmp_path / n for n in ("left.png", "right.png", "camera.yml"))
        write_png(left, pair.left)
        write_png(right, pair.right)
        shift = -calibration.focal_px * calibration.baseline_mm / 1000
        camera.write_text(CAMERA_INFO.format(c=calibration, shift=shift))
        argv = ["size", left, right, "--calibration", camera, "--json", *options]
        assert main([str(each) for each in argv]) == ExitCode.OK
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        reading: Reading = json.loads(out)
        return reading

    monkeypatch.setattr(Pipeline, "from_models", opened)
    return run


def codes(reading: Reading) -> set[str]:
    return {reason["code"] for reason in reading["verdict"]["reasons"]}


def sizes(reading: Reading) -> list[float]:
    found = (f["diameter_mm"] for f in reading["fruitlets"])
    return [diameter for diameter in found if diameter is not None]


def flat(value: int) -> ImageU8:
    return np.full((SMALL.height_px, SMALL.width_px, 3), value, np.uint8)


def noise() -> ImageU8:
    rng = np.random.default_rng(1)
    return rng.integers(0, 256, (SMALL.height_px, SMALL.width_px, 3)).astype(np.uint8)


def leaves() -> ImageU8:
    """Soft green blots, without a fruitlet."""
    rng = np.random.default_rng(2)
    blots = cv2.GaussianBlur(rng.normal(size=(SMALL.height_px, SMALL.width_px)), (0, 0), 12)
    light = np.clip(90 + 60 * blots / blots.std(), 0, 255)
    return np.stack([light * 0.5, light, light * 0.35], axis=-1).astype(np.uint8)


@pytest.mark.parametrize(
    ("left", "expected"),
    [
        (flat(0), {"no_tag", "too_dark"}),
        (flat(255), {"no_tag", "overexposed"}),
        (flat(GREY), {"no_tag"}),
        (noise(), {"no_tag"}),
        (leaves(), {"no_tag"}),
    ],
    ids=["black", "white", "grey", "noise", "leaves"],
)
def test_a_picture_of_nothing_has_no_sizes(size: Size, left: ImageU8, expected: set[str]) -> None:
    right = np.roll(left, -90, axis=1)
    reading = size(StereoPair(left, right), SMALL, "--tag", 17, "--expect", 5)
    assert reading["tag"] is None
    assert reading["verdict"]["status"] == "retake"
    assert expected <= codes(reading)
    assert sizes(reading) == []


def test_the_good_pair_has_sizes(size: Size, scene: SimulatedCapture) -> None:
    reading = size(scene.pair, scene.calibration)
    truth = [f.diameter_mm for f in scene.truth.fruitlets]
    assert reading["tag"]["id"] == scene.truth.tag_id
    assert len(sizes(reading)) >= 2
    assert min(truth) - 1.5 < min(sizes(reading)) <= max(sizes(reading)) < max(truth) + 1.5
    assert not codes(reading) & {"no_tag", "no_fruitlets", "no_depth", "swapped_eyes", "mispaired"}


def tag_box(scene: SimulatedCapture, shift_px: float = 0.0) -> Region:
    """The tag's card in the left image, or `shift_px` further left."""
    x, y, z = scene.truth.tag_center_mm
    camera = scene.calibration
    u = camera.focal_px * x / z + camera.cx_px - shift_px
    v = camera.focal_px * y / z + camera.cy_px
    half = CARD_MM / 2 * camera.focal_px / z
    return Region(round(u - half), round(v - half), round(u + half), round(v + half))


def boxes_of_both_eyes(scene: SimulatedCapture) -> tuple[Region, Region]:
    shift = scene.calibration.disparity_px(scene.truth.tag_center_mm[2])
    return tag_box(scene), tag_box(scene, shift)


def without_tag(scene: SimulatedCapture) -> StereoPair:
    eyes = [scene.pair.left.copy(), scene.pair.right.copy()]
    for eye, box in zip(eyes, boxes_of_both_eyes(scene), strict=True):
        eye[box.slices] = GREY
    left, right = eyes
    return StereoPair(left, right)


def only_tag(scene: SimulatedCapture) -> StereoPair:
    eyes: list[ImageU8] = []
    for eye, box in zip(
        (scene.pair.left, scene.pair.right), boxes_of_both_eyes(scene), strict=True
    ):
        bare = np.full_like(eye, GREY)
        bare[box.slices] = eye[box.slices]
        eyes.append(bare)
    left, right = eyes
    return StereoPair(left, right)


def crowded(scene: SimulatedCapture, count: int = 60) -> StereoPair:
    """The best visible fruitlet many times over, around the tag and at one depth."""
    model = max(scene.truth.target, key=lambda f: f.visible_fraction)
    x0, y0, x1, y1 = (round(v) for v in model.box_px)
    patch = scene.pair.left[y0 - 4 : y1 + 4, x0 - 4 : x1 + 4]
    shift = round(scene.calibration.disparity_px(model.range_mm))
    box = tag_box(scene)
    left, right = scene.pair.left.copy(), scene.pair.right.copy()
    height, width = patch.shape[:2]
    cells = [
        (row, column)
        for row in range(box.y0 - 280, box.y1 + 280 - height, 76)
        for column in range(box.x0 - 280, box.x1 + 280 - width, 76)
        if not (abs(row - box.y0) < 110 and abs(column - box.x0) < 110)
    ]
    for row, column in cells[:count]:
        for eye, start in ((left, column), (right, column - shift)):
            if 0 <= row < eye.shape[0] - height and 0 <= start < eye.shape[1] - width:
                eye[row : row + height, start : start + width] = patch
    return StereoPair(left, right)


def test_fruit_without_a_tag_is_in_no_target(size: Size, scene: SimulatedCapture) -> None:
    reading = size(without_tag(scene), scene.calibration)
    assert reading["tag"] is None
    assert "no_tag" in codes(reading)
    assert reading["verdict"]["status"] == "retake"
    assert reading["fruitlets"]
    assert not any(f["in_target"] for f in reading["fruitlets"])


def test_a_tag_without_fruit_has_no_sizes(size: Size, scene: SimulatedCapture) -> None:
    reading = size(only_tag(scene), scene.calibration)
    assert reading["tag"]["id"] == scene.truth.tag_id
    assert reading["verdict"]["status"] == "retake"
    assert "no_fruitlets" in codes(reading)
    assert sizes(reading) == []


def test_another_tag_than_the_expected_one_is_said(size: Size, scene: SimulatedCapture) -> None:
    other = scene.truth.tag_id + 1
    reading = size(only_tag(scene), scene.calibration, "--tag", other)
    assert reading["verdict"]["status"] == "retake"
    assert "wrong_tag" in codes(reading)


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda p: StereoPair(p.left, p.left), {"mispaired", "swapped_eyes"}),
        (lambda p: StereoPair(p.right, p.left), {"swapped_eyes"}),
        (lambda p: StereoPair(p.left, np.zeros_like(p.left)), {"mispaired", "too_dark"}),
    ],
    ids=["left given as right", "swapped", "right eye black"],
)
def test_eyes_that_do_not_belong_together_are_never_accepted(
    size: Size,
    scene: SimulatedCapture,
    spoil: Callable[[StereoPair], StereoPair],
    expected: set[str],
) -> None:
    reading = size(spoil(scene.pair), scene.calibration)
    assert reading["verdict"]["status"] == "retake"
    assert codes(reading) & expected
    assert sizes(reading) == []


def test_sixty_fruitlets_are_read(size: Size, scene: SimulatedCapture) -> None:
    reading = size(crowded(scene), scene.calibration)
    assert len(reading["fruitlets"]) >= FEWEST_OF_60
    for fruitlet in reading["fruitlets"]:
        assert (fruitlet["diameter_mm"] is None) == bool(fruitlet["flags"])


def refused(capsys: pytest.CaptureFixture[str], *argv: object) -> str:
    code = main([str(each) for each in argv])
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if line.startswith("fieldcam: ")]
    assert code == ExitCode.BAD_INPUT
    assert out == "" and len(lines) == 1 and lines[0].endswith((".", "?"))
    assert "Traceback" not in err
    return lines[0]


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def make_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


SPOILED: dict[str, Callable[[Path], object]] = {
    "missing": Path.unlink,
    "empty": lambda path: path.write_bytes(b""),
    "truncated": truncate,
    "text": lambda path: path.write_text("not a picture"),
    "16 bits": lambda path: cv2.imwrite(str(path), np.zeros((48, 64), np.uint16)),
    "folder": make_folder,
}


@pytest.mark.parametrize("command", ["tags", "segment", "disparity"])
@pytest.mark.parametrize("spoil", SPOILED.values(), ids=SPOILED)
def test_no_command_reads_a_spoiled_image(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    command: str,
    spoil: Callable[[Path], object],
) -> None:
    image, other, out = (tmp_path / name for name in ("image.png", "other.png", "out.npy"))
    for path in (image, other):
        write_png(path, noise())
    spoil(image)
    said = refused(capsys, command, image, *([other, out] if command == "disparity" else []))
    assert str(image) in said
    assert not out.exists()


@pytest.mark.parametrize("role", ["segmentation", "stereo"])
def test_a_network_with_one_changed_byte_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, role: str
) -> None:
    folder = tmp_path / "data" / "models"
    shutil.copytree(SHIPPED_FOLDER, folder)
    path = folder / json.loads((folder / "manifest.json").read_text())[role]["file"]
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    write_png(tmp_path / "image.png", flat(GREY))
    assert "SHA-256" in refused(capsys, "segment", tmp_path / "image.png")


@pytest.mark.parametrize("role", ["segmentation", "stereo"])
def test_a_file_that_cannot_take_a_networks_role_is_refused_and_not_added(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, role: str
) -> None:
    models, data = find_models(), tmp_path / "data"
    other = models.stereo if role == "segmentation" else models.segmentation
    (tmp_path / "hello.onnx").write_text("hello")
    for wrong in (other.path, tmp_path / "hello.onnx"):
        assert wrong.name in refused(capsys, "models", "add", role, wrong, "--data", data)
    assert not data.exists()


@pytest.mark.parametrize("size_px", [(1, 1), (1, 50), (50, 1), (2, 2), (1000, 2), (9, 9), (10, 10)])
def test_a_tiny_image_holds_no_tag(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, size_px: tuple[int, int]
) -> None:
    image = tmp_path / "tiny.png"
    write_png(image, np.zeros(size_px, np.uint8))
    assert main(["tags", str(image), "--json"]) == ExitCode.OK
    assert json.loads(capsys.readouterr().out) == {"tags": []}


def test_a_search_beyond_the_image_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    image, out = tmp_path / "image.png", tmp_path / "out.npy"
    write_png(image, noise()[:96, :128])
    said = refused(capsys, "disparity", image, image, out, "--max-disparity", 999_999)
    assert "128 px" in said
