"""Folders of captures are read in both layouts, and odd files are listed."""

from __future__ import annotations

from datetime import date, datetime
from pathlib import Path

import pytest

from fieldcam.errors import BadInput
from fieldcam.exchange.capture_folder import read_capture_folder, recording_day


def fill(folder: Path, *names: str) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x")
    return folder


def listed(folder: Path) -> list[tuple[str, int, int, str, str | None]]:
    """Day, tag, view, left file and calibration of every capture."""
    return [
        (
            capture.day.isoformat(),
            capture.tag_id,
            capture.view,
            str(capture.left.relative_to(folder)),
            None if capture.calibration is None else str(capture.calibration.relative_to(folder)),
        )
        for capture in read_capture_folder(folder).captures
    ]


def problems(folder: Path) -> dict[str, str]:
    found = read_capture_folder(folder).problems
    return {str(problem.path.relative_to(folder)): problem.text for problem in found}


def eyes(stem: str, suffix: str = ".png") -> tuple[str, str]:
    return f"{stem}_left{suffix}", f"{stem}_right{suffix}"


def test_own_layout(tmp_path: Path) -> None:
    fill(
        tmp_path,
        *eyes("2026-05-21/17_2"),
        *eyes("2026-05-21/17_1"),
        *eyes("2026-05-21/9_1", ".PNG"),
        *eyes("2026-05-25/17_1", ".ppm"),
        "2026-05-25/calibration.yml",
        "calibration.yml",
    )
    assert listed(tmp_path) == [
        ("2026-05-21", 9, 1, "2026-05-21/9_1_left.PNG", "calibration.yml"),
        ("2026-05-21", 17, 1, "2026-05-21/17_1_left.png", "calibration.yml"),
        ("2026-05-21", 17, 2, "2026-05-21/17_2_left.png", "calibration.yml"),
        ("2026-05-25", 17, 1, "2026-05-25/17_1_left.ppm", "2026-05-25/calibration.yml"),
    ]
    assert problems(tmp_path) == {}
    right = read_capture_folder(tmp_path).captures[0].right
    assert right == tmp_path / "2026-05-21" / "9_1_right.PNG"


def test_the_authors_tree(tmp_path: Path) -> None:
    fill(
        tmp_path,
        "17_2023-05-19-22-10-00/COLOR/0_LEFT_a.png",
        "17_2023-05-19-22-10-00/COLOR/0_RIGHT_a.png",
        "17_2023-05-19-22-10-00/COLOR/1_LEFT_a.png",
        "17_2023-05-19-22-10-00/COLOR/1_RIGHT_a.png",
        "17_2023-05-20-03-59-59/COLOR/LEFT.png",
        "17_2023-05-20-03-59-59/COLOR/RIGHT.png",
        "17_2023-06-01-01-00-00/COLOR/LEFT.png",
        "17_2023-06-01-01-00-00/COLOR/RIGHT.png",
        "2023_05_19.yml",
        "camera_info/2023_05_19.yml",
        "camera_info/2023_05_31.yml",
    )
    first, second = "17_2023-05-19-22-10-00/COLOR", "17_2023-05-20-03-59-59/COLOR"
    third = "17_2023-06-01-01-00-00/COLOR"
    assert listed(tmp_path) == [
        ("2023-05-19", 17, 1, f"{first}/0_LEFT_a.png", "2023_05_19.yml"),
        ("2023-05-19", 17, 2, f"{first}/1_LEFT_a.png", "2023_05_19.yml"),
        ("2023-05-19", 17, 3, f"{second}/LEFT.png", "2023_05_19.yml"),
        ("2023-05-31", 17, 1, f"{third}/LEFT.png", "camera_info/2023_05_31.yml"),
    ]
    assert problems(tmp_path) == {}


def test_left_in_a_folders_name_is_left_alone(tmp_path: Path) -> None:
    folder = tmp_path / "LEFT"
    fill(folder, "3_2023-05-19-12-00-00/COLOR/LEFT.png", "3_2023-05-19-12-00-00/COLOR/RIGHT.png")
    (capture,) = read_capture_folder(folder).captures
    assert capture.right == folder / "3_2023-05-19-12-00-00" / "COLOR" / "RIGHT.png"


@pytest.mark.parametrize(
    ("started", "day"),
    [
        (datetime(2023, 5, 1, 3, 59, 59), date(2023, 4, 30)),
        (datetime(2023, 5, 1, 4, 0, 0), date(2023, 5, 1)),
        (datetime(2024, 3, 1, 0, 0, 0), date(2024, 2, 29)),
        (datetime(2024, 1, 1, 1, 0, 0), date(2023, 12, 31)),
    ],
)
def test_before_four_in_the_morning_it_is_still_the_day_before(
    started: datetime, day: date
) -> None:
    assert recording_day(started) == day


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        ("2026-05-21/5_1_left.png", "no partner"),
        ("2026-05-21/5_1_right.png", "no partner"),
        ("2026-05-21/17_1_left.jpg", "same view"),
        ("2026-05-21/17_left.png", "no <tag>_<n>_left"),
        ("2026-05-21/notes.txt", "no <tag>_<n>_left"),
        ("readme.txt", "belongs to no capture"),
        ("17_2023-05-19-22-10-00/COLOR/LEFT.png", "no partner"),
        ("17_2023-05-19-22-10-00/COLOR/RIGHT.png", "no partner"),
        ("17_2023-05-19-22-10-00/COLOR/depth.png", "neither a LEFT nor a RIGHT"),
    ],
)
def test_odd_files_are_listed_beside_the_good_ones(tmp_path: Path, odd: str, words: str) -> None:
    fill(tmp_path, *eyes("2026-05-21/17_1"), "calibration.yml", odd)
    assert [capture[:3] for capture in listed(tmp_path)] == [("2026-05-21", 17, 1)]
    found = problems(tmp_path)
    (text,) = found.values()
    assert words in text and text.endswith(".")


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        ("2026-02-30/17_1_left.png", "no day of the calendar"),
        ("17_2023-05-19-25-10-00/COLOR/LEFT.png", "does not name a time"),
        ("17_2023-05-19-22-10-00/IR/LEFT.png", "holds no images in COLOR"),
        ("other/17_1_left.png", "neither a day nor a recording"),
        ("0001-01-01/17_1_left.png", "neither a day nor a recording"),
    ],
)
def test_odd_folders_are_listed(tmp_path: Path, odd: str, words: str) -> None:
    fill(tmp_path, *eyes("2026-05-21/17_1"), "calibration.yml", odd)
    found = problems(tmp_path)
    assert list(found) == [odd.partition("/")[0]]
    assert words in found[odd.partition("/")[0]]


def test_hidden_files_are_nobodys_business(tmp_path: Path) -> None:
    fill(tmp_path, *eyes("2026-05-21/17_1"), "calibration.yml", ".x", "2026-05-21/._17_1_left.png")
    assert problems(tmp_path) == {}


OF_A_RECORDING = tuple(f"9999_2023-05-19-22-10-00/COLOR/{side}.png" for side in ("LEFT", "RIGHT"))


@pytest.mark.parametrize(
    ("files", "obstacle"),
    [
        (
            eyes("2026-05-21/586_1"),
            "There is no calibration for 2026-05-21: "
            "put calibration.yml into the folder that is imported.",
        ),
        ((*eyes("2026-05-21/586_1"), "calibration.yml"), ""),
        ((*eyes("2026-05-21/587_1"), "calibration.yml"), "There is no tag 587: they end at 586."),
        ((*OF_A_RECORDING, "2023_05_19.yml"), "There is no tag 9999: they end at 586."),
        (OF_A_RECORDING, "There is no tag 9999: they end at 586."),
    ],
)
def test_what_stands_against_a_pair_is_known_by_its_place(
    tmp_path: Path, files: tuple[str, ...], obstacle: str
) -> None:
    (capture,) = read_capture_folder(fill(tmp_path, *files)).captures
    assert capture.obstacle == obstacle
    assert problems(tmp_path) == {}


def test_what_is_no_folder_of_captures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="There is no folder"):
        read_capture_folder(tmp_path / "absent")
    with pytest.raises(BadInput, match="holds no captures"):
        read_capture_folder(fill(tmp_path, "readme.txt"))
    with pytest.raises(BadInput, match="There is no folder"):
        read_capture_folder(tmp_path / "readme.txt")
