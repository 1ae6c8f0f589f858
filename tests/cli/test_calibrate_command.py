"""`fieldcam calibrate`: from pictures, or the camera itself, to files that are read back."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import pytest
from rendered_boards import Head, photograph, printed_charuco, random_head, random_poses

from fieldcam.calibration.reading.readers import load_stereo_rig
from fieldcam.calibration.reading.sources import WHOLE, open_documents
from fieldcam.camera import finding
from fieldcam.camera.preview import Preview
from fieldcam.cli import main
from fieldcam.cli.doctor import Health, _calibration
from fieldcam.errors import CameraUnplugged, CaptureTimeout, ExitCode
from fieldcam.exchange.board_pairs import read_pair_folder
from fieldcam.exchange.images import read_image
from fieldcam.store.calibrations import calibration_in_use
from fieldcam.values import Calibration, ImageU8, PixelFormat, RawPair

Capture = pytest.CaptureFixture[str]
Pair = tuple[ImageU8, ImageU8]
OPTIONS = ["--board", "charuco", "--squares", "6x4", "--square-mm", "30"]
VIEWS = 10


@pytest.fixture(autouse=True)
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is read from or written to the user's own folders."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "xdg-data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "xdg-state"))
    monkeypatch.delenv("FIELDCAM_DATA", raising=False)


@pytest.fixture(scope="module")
def head() -> Head:
    return random_head(np.random.default_rng(7)).shrunk(3)


@pytest.fixture(scope="module")
def pairs(head: Head) -> list[Pair]:
    """Rendered pictures, small so that they are made fast."""
    rng = np.random.default_rng(7)
    board = printed_charuco(6, 4, 30.0)
    poses = random_poses(rng, head, board, VIEWS)
    return [photograph(head, board, pose, rng, blur_px=0.6) for pose in poses]


def save(path: Path, image: ImageU8) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), image)


@pytest.fixture
def folder(tmp_path: Path, pairs: list[Pair]) -> Path:
    """All pairs, and one that shows nothing."""
    place = tmp_path / "pairs"
    for i, (left, right) in enumerate([*pairs, (np.full_like(pairs[0][0], 90),) * 2], 1):
        save(place / f"{i}_left.png", left)
        save(place / f"{i}_right.png", right)
    return place


def test_a_folder_becomes_the_calibration_in_use(
    tmp_path: Path, folder: Path, head: Head, capsys: Capture
) -> None:
    data = tmp_path / "data"
    save(folder / "12_left.png", np.zeros((9, 9), np.uint8))
    assert main(["calibrate", str(folder), "--data", str(data), *OPTIONS]) == ExitCode.OK
    said = capsys.readouterr()
    in_use = calibration_in_use(data)
    assert in_use is not None and str(in_use.parent) in said.out
    assert "12_left.png has no partner" in said.err and "The app uses it from now on." in said.err
    rig = load_stereo_rig(in_use)
    # These pictures have a ninth of the real ones' pixels.
    assert rig.rectified.baseline_mm == pytest.approx(head.baseline_mm, abs=0.3)
    assert rig.left.camera_matrix[0, 0] == pytest.approx(head.left.fx, rel=5e-3)
    assert f"Baseline {rig.rectified.baseline_mm:.2f} mm" in said.out
    known = _calibration(data)
    assert known.health is Health.GOOD and known.text.startswith("0001-")
    in_use.write_text("M1: nothing")
    assert _calibration(data).health is Health.BAD
    assert _calibration(tmp_path).health is Health.WARNING
    rows = said.out.split("\n\n")[0].splitlines()
    assert rows[0].split()[0] == "view" and len(rows) == 1 + VIEWS + 1
    assert rows[-1].endswith("no: neither eye sees the board")
    assert read_image(in_use.parent / "coverage.png").shape[1] == 1200


def test_json_is_the_report_beside_the_files(tmp_path: Path, folder: Path, capsys: Capture) -> None:
    out = tmp_path / "new" / "calibration"
    assert main(["calibrate", str(folder), "--out", str(out), "--json", *OPTIONS]) == ExitCode.OK
    said = json.loads(capsys.readouterr().out)
    assert {path.name for path in out.iterdir()} == {
        "left.yml", "right.yml", "intrinsics.yml", "extrinsics.yml", "calibration.yml",
        "report.json", "coverage.png",
    }  # fmt: skip
    assert said.pop("out") == str(out)
    assert json.loads((out / "report.json").read_text()) == said
    assert said["baseline_mm"] == pytest.approx(60.0, abs=0.6)
    assert said["board"] == {"kind": "charuco", "columns": 6, "rows": 4, "square_mm": 30.0}
    assert [view["name"] for view in said["views"]] == [str(i + 1) for i in range(VIEWS)]
    assert all(view["used"] != bool(view["why_dropped"]) for view in said["views"])
    assert said["unseen"] == [{"name": "11", "why": "neither eye sees the board"}]
    assert len(said["coverage"]["left_corners"]) == 3
    before = (out / "report.json").read_bytes()
    assert main(["calibrate", str(folder), "--out", str(out), *OPTIONS]) == ExitCode.BAD_INPUT
    assert "written over" in capsys.readouterr().err
    assert (out / "report.json").read_bytes() == before


def test_pairs_are_known_by_each_layout(tmp_path: Path) -> None:
    image = np.zeros((8, 8), np.uint8)
    layouts: dict[str, tuple[str, ...]] = {
        "own": ("2_left.png", "2_right.png", "10_left.png", "10_right.png"),
        "authors": ("2LEFT.png", "2RIGHT.png", "10LEFT.png", "10RIGHT.png"),
        "folders": ("LEFT/2.png", "RIGHT/2.png", "LEFT/10.png", "RIGHT/10.png"),
    }
    for layout, names in layouts.items():
        for name in names:
            save(tmp_path / layout / name, image)
        found = read_pair_folder(tmp_path / layout)
        assert len(found.pairs) == 2 and not found.problems, layout
        assert found.pairs[0].name.startswith("2") and found.pairs[1].name.startswith("10")
        assert "left" in str(found.pairs[0].left.relative_to(tmp_path)).lower()


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["1_left.png", "2_left.png"], "holds 2 images of the left eye and none of the right one."),
        (["1RIGHT.png"], "holds 1 image of the right eye and none of the left one."),
        (["left/1.png", "left/2.png"], "holds 2 images of the left eye and none of the right"),
        (["1_left.png", "2_right.png"], "holds images of both eyes, but no two of the same name."),
        (["board.png", "notes.txt"], "holds no pairs."),
    ],
)
def test_a_folder_without_pairs_says_what_is_missing(
    tmp_path: Path, capsys: Capture, names: list[str], words: str
) -> None:
    for name in names:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.touch()
    assert main(["calibrate", str(tmp_path)]) == ExitCode.BAD_INPUT
    said = capsys.readouterr()
    assert said.out == "" and f"{tmp_path} {words}" in said.err


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"left_serial": 1, "right_serial": "B"}'])
def test_a_damaged_note_of_the_head_is_refused(
    tmp_path: Path, folder: Path, capsys: Capture, content: str
) -> None:
    (folder / "head.json").write_text(content)
    out = tmp_path / "out"
    assert main(["calibrate", str(folder), "--out", str(out), *OPTIONS]) == ExitCode.BAD_INPUT
    assert "does not say which head took the pictures" in capsys.readouterr().err
    assert not out.exists()


Spoil = Callable[[Path], object]


def other_size(folder: Path) -> None:
    for eye in ("left", "right"):
        save(folder / f"3_{eye}.png", np.full((200, 300), 90, np.uint8))


def other_size_of_one_eye(folder: Path) -> None:
    save(folder / "3_left.png", np.full((200, 300), 90, np.uint8))


def swap(folder: Path) -> None:
    for left in folder.glob("*_left.png"):
        right = left.with_name(left.name.replace("left", "right"))
        aside = left.rename(folder / "aside")
        right.rename(left)
        aside.rename(right)


def blind(folder: Path) -> None:
    for path in folder.glob("*_right.png"):
        save(path, np.full((360, 480), 90, np.uint8))


def thin_out(folder: Path) -> None:
    for path in [*folder.glob("[4-9]_*"), *folder.glob("1?_*")]:
        path.unlink()


def cut(folder: Path) -> None:
    path = folder / "2_left.png"
    path.write_bytes(path.read_bytes()[:-50])


@pytest.mark.parametrize(
    ("spoil", "options", "words"),
    [
        (other_size, OPTIONS, "300 x 200 pixels"),
        (other_size_of_one_eye, OPTIONS, "Give the two images of one exposure"),
        (swap, OPTIONS, "eyes are swapped"),
        (blind, OPTIONS, "only the left eye sees the board"),
        (thin_out, OPTIONS, "in 3 of the pairs"),
        (cut, OPTIONS, "is truncated"),
        (bool, [*OPTIONS[:-1], "0.5"], "--square-mm"),
        (thin_out, ["--board", "checkerboard"], "checkerboard of 9 x 6 squares"),
    ],
)
def test_pairs_that_tell_nothing_leave_nothing(
    tmp_path: Path, folder: Path, capsys: Capture, spoil: Spoil, options: list[str], words: str
) -> None:
    spoil(folder)
    out = tmp_path / "calibration"
    assert main(["calibrate", str(folder), "--out", str(out), *options]) == ExitCode.BAD_INPUT
    said = capsys.readouterr()
    assert said.out == "" and words in said.err.splitlines()[-1]
    assert not [path for path in tmp_path.iterdir() if "calibration" in path.name]


@pytest.mark.parametrize(
    "argv",
    [
        [],
        ["nowhere"],
        ["."],
        [".", "--squares", "nine"],
        [".", "--squares", "7x7"],
        [".", "--square-mm", "0"],
        [".", "--board", "circles"],
        ["--print-board", "board.png"],
        ["--print-board", "board.pdf", "--squares", "30x20"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture, argv: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", *argv]) == ExitCode.BAD_INPUT
    out, err = capsys.readouterr()
    assert out == "" and len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_board_is_printed(tmp_path: Path, capsys: Capture) -> None:
    out = tmp_path / "board.pdf"
    assert main(["calibrate", "--print-board", str(out), *OPTIONS, "--json"]) == ExitCode.OK
    said = json.loads(capsys.readouterr().out)
    assert said["file"] == str(out) and said["board"]["square_mm"] == 30.0
    assert out.read_bytes().startswith(b"%PDF-1.4")
    printed = out.read_bytes()
    assert main(["calibrate", "--print-board", str(out)]) == ExitCode.BAD_INPUT
    said = capsys.readouterr()
    assert said.out == "" and f"{out} is there already." in said.err
    assert out.read_bytes() == printed
    other = tmp_path / "other.pdf"
    assert main(["calibrate", "--print-board", str(other)]) == ExitCode.OK
    assert "9x6 squares of 20 mm" in capsys.readouterr().out


class BoardCamera:
    """A camera before which somebody holds a board; gone after the last picture."""

    def __init__(self, pairs: list[Pair], mosaic: bool = False) -> None:
        self._pairs: Iterator[Pair] = iter(pairs)
        self._format = PixelFormat.BAYER_RG8 if mosaic else PixelFormat.MONO8
        self._taken = 0
        self.closed = False

    @property
    def serials(self) -> tuple[str, str]:
        return "1", "2"

    @property
    def calibration(self) -> Calibration | None:
        return None

    def capture(self, deadline_s: float) -> RawPair:
        self._taken += 1
        if self._taken == 3:
            raise CaptureTimeout("The camera gave no pair within 5 s.")
        pair = next(self._pairs, None)
        if pair is None:
            raise CameraUnplugged("The camera is unplugged.", "Check its cable.")
        when = datetime(2026, 5, 1, tzinfo=UTC)
        return RawPair(*pair, self._format, when, 0, 0, *self.serials, self._taken)

    def preview(self, deadline_s: float) -> Preview | None:
        return None

    def attend(self) -> None:
        """It is always there."""

    def watch_shutter(self, pressed: Callable[[], None]) -> None:
        pass

    def close(self) -> None:
        self.closed = True

    def __enter__(self) -> BoardCamera:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def test_the_camera_takes_pictures_until_it_is_lost(
    tmp_path: Path, pairs: list[Pair], monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """The guide asks for more than these; what was taken is kept and can be used."""
    grey = np.full_like(pairs[0][0], 90)
    shown = [pairs[0], pairs[0], (grey, grey), (pairs[1][0], grey), *pairs[1:]]
    camera = BoardCamera(shown)
    monkeypatch.setattr(finding, "open_camera", lambda data: camera)
    taken, out = tmp_path / "taken", tmp_path / "out"
    argv = ["calibrate", str(taken), "--out", str(out), *OPTIONS]
    assert main([*argv, "--camera", "--views", "10"]) == ExitCode.DEVICE
    assert camera.closed
    said = capsys.readouterr().err.splitlines()
    assert said[1].startswith("View 1 kept. Hold the board in the ")
    assert said[2].startswith("Nothing new. Hold the board ")
    assert said[3] == "The camera gave no pair within 5 s."
    assert said[4].startswith("Neither eye sees the board. Hold the board ")
    assert said[5].startswith("Only the left eye sees the board. ")
    assert said[-1] == "fieldcam: The camera is unplugged. Check its cable."
    found = read_pair_folder(taken)
    assert len(found.pairs) == VIEWS and not found.problems
    assert np.array_equal(read_image(found.pairs[0].left)[..., 0], pairs[0][0])
    assert main(argv) == ExitCode.OK
    assert open_documents(out / "calibration.yml")[WHOLE].serials() == camera.serials
    assert main([*argv[:2], "--camera", *OPTIONS]) == ExitCode.BAD_INPUT
    assert "is not empty" in capsys.readouterr().err


def test_enough_pictures_are_solved_at_once(
    tmp_path: Path, pairs: list[Pair], monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    from fieldcam.calibration import guide

    monkeypatch.setattr(finding, "open_camera", lambda data: BoardCamera(pairs, mosaic=True))
    monkeypatch.setattr(guide.Guide, "done", property(lambda self: self.kept >= VIEWS))
    argv = ["calibrate", str(tmp_path / "taken"), "--out", str(tmp_path / "out"), "--camera"]
    assert main([*argv, *OPTIONS]) == ExitCode.OK
    said = capsys.readouterr()
    assert f"of {VIEWS} pairs count" in said.out
    assert len(list((tmp_path / "taken").glob("*.png"))) == 2 * VIEWS


def test_without_a_camera_it_is_a_device_error(tmp_path: Path, capsys: Capture) -> None:
    argv = ["calibrate", str(tmp_path / "taken"), "--out", str(tmp_path / "out"), "--camera"]
    assert main(argv) == ExitCode.DEVICE
    assert "No camera" in capsys.readouterr().err
