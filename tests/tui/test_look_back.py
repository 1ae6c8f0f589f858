"""The screens that look back: Cluster, Block and Device, on a small real store."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import date, timedelta
from pathlib import Path

import pytest
from screens import LARGE, SMALL, Driven, check_golden, drive
from stored_walks import MadeWalk, small_store
from textual.widgets import Input

from fieldcam.analysis.status import AnalysisState, AnalysisStatus
from fieldcam.calibration.stored_drift import TagSizes
from fieldcam.session.battery import Battery
from fieldcam.session.commands import (
    AcceptPicture,
    AddByHand,
    CrownKing,
    GoTo,
    RestartAnalysis,
    UndoFruit,
)
from fieldcam.session.events import Refused
from fieldcam.session.over_days.days import cluster_days
from fieldcam.session.state import CameraState, WalkState
from fieldcam.session.viewing import WalkView
from fieldcam.store.queries.walks import ClusterState
from fieldcam.store.rows.judgements import Action, Decision, FruitletMark, MarkKind, Note, Skip
from fieldcam.store.space import Space
from fieldcam.tui.screens.block_screen import duration
from fieldcam.tui.text.device_words import (
    Disk,
    analysis_facts,
    battery_fact,
    calibration_facts,
    camera_facts,
    disk_fact,
)
from fieldcam.tui.text.histogram import histogram
from fieldcam.tui.text.history_words import day_lines, picture_line

SIZES = pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])


@dataclass
class Past:
    """A block with two days and a bit, and the state of the second one."""

    made: MadeWalk
    state: WalkState
    pictures: list[str]
    """Captures of tag 11, the earliest first."""


@pytest.fixture
def past(tmp_path: Path) -> Iterator[Past]:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        store.sign_in("Ann")
        first, second = made.visit(), made.visit(2)
        pictures = [made.take(first, 11).key]
        made.read(pictures[0], 11, 3)
        store.append(Decision(pictures[0], Action.RETAKE))
        pictures += [made.accept(first, 11, 5), made.accept(second, 11, 4)]
        store.append(FruitletMark.on_cluster(MarkKind.FALLEN, second, 11))
        store.append(Note("A leaf before it.", pictures[2]))
        made.accept(first, 12, 6)
        store.append(Skip(second, 21))
        made.take(second, 22)
        state = replace(WalkView(store, second).state(), tag_id=11, free_bytes=72_000_000_000)
        yield Past(made, state, pictures)


def screen_of(size: tuple[int, int], state: WalkState, *keys: str) -> str:
    """The text after these keys."""
    shown: list[str] = []

    async def script(driven: Driven) -> None:
        await driven.tell(state)
        await driven.press(*keys)
        shown.append(driven.text)

    drive(size, script)
    return shown[0]


NAMES = {"v": "Cluster", "b": "Block", "i": "Device"}


@SIZES
def test_screens_that_look_back(
    size: tuple[int, int], past: Past, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Space, "free_bytes", 72_000_000_000)
    monkeypatch.setattr(
        "fieldcam.tui.screens.device_screen.batteries", lambda: (Battery(87, "charging"),)
    )

    async def script(driven: Driven) -> None:
        await driven.tell(past.state)
        for key, name in NAMES.items():
            await driven.press(key)
            check_golden(f"{name.lower()}-{size[0]}x{size[1]}", driven.text)

    drive(size, script)


def test_pictures_are_gone_through_in_a_circle(past: Past) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(past.state)
        await driven.press("v")
        seen = []
        for _ in range(4):
            found = re.search(r"Picture (\d/\d)   \w+   ([\w ]+?)   \d", driven.text)
            assert found is not None
            seen.append(found.groups())
            await driven.press("left")
        assert seen == [
            ("3/3", "accepted"),
            ("2/3", "accepted"),
            ("1/3", "to be taken again"),
            ("3/3", "accepted"),
        ]
        await driven.press("right")
        assert "Picture 3/3" in driven.text

    drive(SMALL, script)


def test_marks_go_to_the_picture_that_is_shown(past: Past) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(past.state)
        await driven.press("v", "left")
        await driven.press("down", "down", "k", "m", *"9.5", "enter", "u", "m", "escape")
        assert not driven.app.screen.query(Input)

    asked = drive(SMALL, script).walk.asked
    capture = past.pictures[1]
    assert asked == [CrownKing(capture, 2), AddByHand(capture, 9.5), UndoFruit(11)]


def test_a_picture_without_a_decision_is_decided_on_walk(past: Past) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(past.state)
        await driven.press("v", "enter")
        assert "decided on already" in driven.text
        await driven.tell(replace(past.state, tag_id=22))
        assert "not decided: Enter goes to Walk" in driven.text
        await driven.press("enter")
        assert driven.text.startswith(" Walk")
        earlier = replace(past.state.route, visit="another")
        await driven.tell(replace(past.state, tag_id=22, route=earlier))
        await driven.press("v", "enter")
        assert "This picture is of an earlier visit." in driven.text
        await driven.press("x", "enter", "y")

    asked = drive(SMALL, script).walk.asked
    assert [type(each) for each in asked] == [GoTo, AcceptPicture]


@pytest.mark.parametrize("view", [1, 12])
def test_what_decides_is_not_cut_in_80_columns(past: Past, view: int) -> None:
    record = past.state.shown.record if past.state.shown is not None else None
    assert record is not None
    longest = replace(record, view=view, retake_of="another", action=None)
    line = picture_line(longest, 12, 12)
    assert "not decided: Enter goes to Walk" in line[:79]


def test_what_was_marked_is_shown(past: Past) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(past.state)
        await driven.press("v")
        record = past.made.store.database.query(
            "SELECT id FROM reading WHERE capture = ?", [past.pictures[2]]
        )
        reading = next(record)["id"]
        past.made.store.append(
            FruitletMark.on_fruitlet(MarkKind.KING, reading, 3),
            FruitletMark(MarkKind.ADDED_BY_HAND, reading=reading, diameter_mm=9.5),
        )
        await driven.tell(past.state)
        assert "D  12.00 mm king" in driven.text
        assert "+   9.50 mm  by hand" in driven.text
        assert "Ann, picture 3: added" in driven.text

    drive(SMALL, script)


def test_a_cluster_without_pictures_and_a_block_without_clusters(past: Past) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(replace(past.state, tag_id=21))
        await driven.press("v")
        assert "There is no picture of this cluster yet." in driven.text
        assert "Ann: skipped" in driven.text
        await driven.tell(replace(past.state, tag_id=None))
        assert "Tag 22" in driven.text
        nothing = replace(past.state.route, block="another", stops=())
        await driven.tell(replace(past.state, tag_id=None, route=nothing))
        assert "This block has no clusters yet." in driven.text
        await driven.press("n")

    drive(SMALL, script)


def test_the_words_can_be_scrolled(past: Past) -> None:
    past.made.store.append(*(Note(f"Note {n}.", past.pictures[2]) for n in range(20)))

    async def script(driven: Driven) -> None:
        await driven.tell(past.state)
        await driven.press("v")
        assert "Note 19." in driven.text and "Note 2." not in driven.text
        for _ in range(6):
            await driven.press("pagedown")
        assert "Note 19." not in driven.text and "picture 2: accepted" in driven.text
        for _ in range(6):
            await driven.press("pageup")
        assert "Note 19." in driven.text

    drive(SMALL, script)


def test_enter_goes_to_a_missing_cluster(past: Past) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(past.state)
        await driven.press("b")
        assert "3 missing" in driven.text
        await driven.press("down", "enter")
        assert "Walk   North" in driven.text

    assert drive(SMALL, script).walk.asked == [GoTo(21)]


def test_when_nothing_is_missing_it_is_said(past: Past) -> None:
    stops = tuple(replace(s, state=ClusterState.ACCEPTED) for s in past.state.route.stops)
    route = replace(past.state.route, stops=stops)
    assert "No cluster is missing." in screen_of(
        SMALL, replace(past.state, route=route), "b", "enter"
    )


def test_the_analysis_can_be_started_again(past: Past) -> None:
    off = AnalysisStatus(AnalysisState.STOPPED, pending=2, restarts=5, last_error="It hung.")

    async def script(driven: Driven) -> None:
        await driven.tell(replace(past.state, analysis=off))
        await driven.press("i")
        assert "! stopped, restarts 5, waiting 2; R starts it again" in driven.text
        assert "last error: It hung." in driven.text
        await driven.press("r")
        await driven.tell(Refused("It runs."))
        assert "It runs." in driven.text

    assert drive(SMALL, script).walk.asked == [RestartAnalysis()]


def test_a_store_that_cannot_be_read_is_said(past: Past) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(replace(past.state, folder=past.state.folder / "gone"))
        for key in NAMES:
            await driven.press(key)
            assert "There is no database at" in driven.text

    drive(SMALL, script)


def test_each_screen_is_reached_in_three_ways_and_left_in_two(past: Past) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(past.state)
        for key, name in NAMES.items():
            await driven.press(key)
            assert driven.text.startswith(f" {name}   North")
            await driven.press(key)
            assert driven.text.startswith(" Walk")
            column = driven.text.splitlines()[-1].index(f"{key} {name}") + 2
            await driven.pilot.click(offset=(column, 23))
            await driven.settle()
            assert driven.text.startswith(f" {name}")
            await driven.press("escape")
            commands = driven.app.get_system_commands(driven.app.screen)
            next(command for command in commands if command.title == name).callback()
            await driven.settle()
            assert driven.text.startswith(f" {name}")
            await driven.press("escape")

    drive(SMALL, script)


def test_one_look_back_leads_to_another(past: Past) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(past.state)
        for key, name in [*NAMES.items(), ("o", "Route"), ("l", "Log"), ("v", "Cluster")]:
            await driven.press(key)
            assert driven.text.startswith(f" {name}")
        await driven.press("escape")
        assert driven.text.startswith(" Walk")

    drive(SMALL, script)


def test_bars_of_sizes_by_day() -> None:
    days = [
        (date(2026, 5, 21), [7.2, 7.9, 8.0, 9.5]),
        (date(2026, 5, 23), []),
        (date(2026, 5, 25), [9.0, 9.1]),
    ]
    lines = histogram(days, 47, 10)
    assert lines[0].split() == ["mm", "21", "May", "25", "May"]
    assert [line.split() for line in lines[1:]] == [
        ["7", "█" * 16, "2"],
        ["8", "█" * 8, "1"],
        ["9", "█" * 8, "1", "█" * 16, "2"],
    ]
    assert max(map(len, lines)) <= 47
    assert histogram(days, 20, 10)[0] == "    mm 25 May"
    assert histogram(days, 47, 3)[1].split()[0] == "6-8"
    assert histogram([], 47, 10) == histogram(days[1:2], 47, 10) == ["No accepted sizes yet."]


def test_growth_is_told_as_exactly_as_it_can_be(
    past: Past, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = cluster_days(past.made.store.database, past.made.block, 11)
    fewer = list(day_lines([first, second]))
    assert fewer[1:4:2] == ["21 May  5: 11.00 mm", "23 May  4: 10.50 mm, ~-0.25 a day"]
    alike = replace(first, day=second.day)
    assert list(day_lines([first, alike]))[3] == "23 May  5: 11.00 mm, +0.00 a day"
    assert list(day_lines([first, first]))[3] == "21 May  5: 11.00 mm"
    leaf = replace(second, day=first.day)
    back = replace(first, day=first.day + timedelta(days=1))
    assert "(no fruit grows so)" not in "".join(day_lines([leaf, back]))
    monkeypatch.setattr("fieldcam.tui.text.history_words.MAX_MM_PER_DAY", 0.4)
    assert list(day_lines([leaf, back]))[3] == (
        "22 May  5: 11.00 mm, ~+0.50 a day (no fruit grows so)"
    )
    unseen = replace(second, counted=(), sizes_mm=(), marks=())
    assert list(day_lines([first, unseen]))[3:] == ["23 May  no accepted picture"]


def test_durations_are_said_in_words() -> None:
    assert [duration(s) for s in (48.4, 60, 3599, 3900)] == [
        "48 s",
        "1 min",
        "59 min",
        "1 h 05 min",
    ]


def test_what_needs_a_hand_is_marked() -> None:
    bad = [
        *camera_facts(CameraState.LOST, None),
        disk_fact(Disk(72_000_000_000, 0, 100)),
        disk_fact(Disk(1_000, 8_000_000, 0)),
        battery_fact([Battery(9, "discharging")]),
        *calibration_facts("", TagSizes((0.03,) * 5)),
    ]
    assert all(fact.bad for fact in bad)
    assert bad[-1].text.startswith("DRIFT: sizes are off by about +3.5%")
    good = [
        *camera_facts(CameraState.READY, None),
        disk_fact(Disk(72_000_000_000, 8_000_000, None)),
        battery_fact([Battery(9, "charging")]),
        battery_fact([]),
        *calibration_facts("", TagSizes((-0.005,) * 5)),
        *calibration_facts("", TagSizes((0.03,) * 2)),
        *calibration_facts("", None),
        *analysis_facts(AnalysisStatus(AnalysisState.READY)),
    ]
    assert not any(fact.bad for fact in good)
    notes = ("EMU-1 is in a USB 2 port.", "EMU-1 is taken for the left camera.")
    assert [fact.text for fact in camera_facts(CameraState.READY, None, notes)][1:] == [*notes]
    assert good[3].text == "no battery"
    assert good[5].text == "fits: -0.5% off; -0.5% is usual, as white grows into black"
