"""A recorded folder is walked with an aimed camera, day by day."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from stored_walks import small_store

from fieldcam.app.replayed import by_day, choose_visit
from fieldcam.camera.aimed import AimedCamera, Wanted
from fieldcam.camera.beside import PictureProcess
from fieldcam.camera.replay import RecordedDay, ReplayProcess, read_recorded
from fieldcam.cli import demo, main
from fieldcam.errors import CameraUnplugged, ExitCode, ImageUnreadable
from fieldcam.exchange.capture_folder import CaptureFile, read_capture_folder
from fieldcam.exchange.images import write_png
from fieldcam.store.queries.walks import walk_route
from fieldcam.store.rows.judgements import Skip
from fieldcam.values import RawPair

FIRST, SECOND = date(2026, 5, 21), date(2026, 5, 24)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Two views of tag 8 and one of tag 9 on the first day, tag 9 on the second."""
    for name, level in {"21/8_1": 10, "21/8_2": 30, "21/9_1": 60, "24/9_1": 90}.items():
        folder = tmp_path / "rows" / f"2026-05-{name[:2]}"
        folder.mkdir(parents=True, exist_ok=True)
        for eye, extra in (("left", 0), ("right", 5)):
            image = np.full((4, 6, 3), level + extra, np.uint8)
            write_png(folder / f"{name[3:]}_{eye}.png", image)
    return tmp_path / "rows"


@pytest.fixture
def captures(recording: Path) -> tuple[CaptureFile, ...]:
    return read_capture_folder(recording).captures


class Here:
    """Decodes in this process."""

    def picture(self, request: CaptureFile) -> RawPair:
        return read_recorded(request)


def recorded(captures: tuple[CaptureFile, ...]) -> Iterator[RecordedDay]:
    for taken in by_day(captures).values():
        yield RecordedDay(cast(PictureProcess, Here()), taken)


def test_a_tags_views_come_in_their_order_and_then_again(
    captures: tuple[CaptureFile, ...],
) -> None:
    first, second = recorded(captures)
    assert (first.tag_ids, second.tag_ids) == ((8, 9), (9,))
    pairs = [first.make(Wanted(8, view)) for view in range(3)]
    assert [(pair.left[0, 0, 0], pair.right[0, 0, 0]) for pair in pairs] == [
        (10, 15),
        (30, 35),
        (10, 15),
    ]
    assert second.make(Wanted(9, 0)).left[0, 0, 0] == 90
    assert not pairs[0].simulated
    assert pairs[0].taken_at.date() == FIRST  # and not when somebody copied the files


def test_the_camera_takes_what_it_is_aimed_at(captures: tuple[CaptureFile, ...]) -> None:
    day = next(recorded(captures))
    with AimedCamera(day) as camera:
        camera.aim(9)
        assert camera.capture(10).left[0, 0, 0] == 60
        assert (camera.serials, camera.calibration) == (("replay-left", "replay-right"), None)


def test_pairs_are_decoded_beside_the_app(captures: tuple[CaptureFile, ...]) -> None:
    with closing(ReplayProcess()) as process:
        assert process.picture(captures[0]).left[0, 0, 0] == 10
        captures[1].right.unlink()
        with pytest.raises(ImageUnreadable):
            process.picture(captures[1])
        assert process.picture(captures[2]).left[0, 0, 0] == 60
    with pytest.raises(CameraUnplugged):
        process.picture(captures[0])


def test_days_without_a_calibration_are_left_out_where_others_have_one(
    captures: tuple[CaptureFile, ...],
) -> None:
    assert list(by_day(captures)) == [FIRST, SECOND]
    calibrated = [replace(captures[-1], calibration=Path("calibration.yml"))]
    assert list(by_day([*captures[:-1], *calibrated])) == [SECOND]


def test_the_next_recorded_day_comes_when_the_first_one_is_done(
    captures: tuple[CaptureFile, ...], tmp_path: Path
) -> None:
    days = by_day(captures)
    with small_store(tmp_path / "data") as store:
        day, visit = choose_visit(store, "rows", days)
        assert (day, [stop.tag_id for stop in walk_route(store.database, visit).stops]) == (
            FIRST,
            [8, 9],
        )
        store.append(Skip(visit, 8), Skip(visit, 9))
        assert choose_visit(store, "rows", days)[0] == SECOND


@pytest.mark.parametrize("terminal", [True, False])
def test_a_folder_is_walked_at_a_terminal_only(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, terminal: bool
) -> None:
    asked: list[tuple[object, ...]] = []
    monkeypatch.setattr(demo, "at_a_terminal", lambda: terminal)
    monkeypatch.setattr(demo, "checked_models", lambda data: None)
    monkeypatch.setattr(
        "fieldcam.app.replayed.walk_recorded_folder", lambda *arguments: asked.append(arguments)
    )
    command = ["--data", str(tmp_path), "demo", "--replay", str(recording)]
    assert main(command) == (ExitCode.OK if terminal else ExitCode.BAD_INPUT)
    assert asked == ([(tmp_path, recording)] if terminal else [])
