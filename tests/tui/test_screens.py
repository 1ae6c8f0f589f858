"""The screens: what they say at two sizes, and what each key asks of the walk."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from live_walks import read
from made_states import AIM, ROUTE, shown_with, verdict
from screens import LARGE, SMALL, Driven, check_golden, drive
from textual.color import Color
from textual.widgets import Input

from fieldcam.analysis.status import AnalysisState, AnalysisStatus
from fieldcam.errors import CameraUnplugged, StorageFull
from fieldcam.session.commands import (
    Accept,
    AnswerQuestion,
    CorrectTag,
    GoTo,
    NextTree,
    OtherTarget,
    Retake,
    SecondView,
    Shoot,
    SkipCluster,
    Step,
    Strike,
    UndoLast,
    WriteNote,
)
from fieldcam.session.events import (
    CameraTrouble,
    Done,
    Doubted,
    LiveEvent,
    Refused,
    Saved,
    StorageTrouble,
    VerdictReady,
)
from fieldcam.session.state import CameraState, WalkState
from fieldcam.store.captures import SavedCapture
from fieldcam.store.queries.walks import ClusterState
from fieldcam.store.rows.judgements import Action, Answer, MarkKind
from fieldcam.tui.screens.walk_screen import WalkScreen
from fieldcam.tui.sound import Tune
from fieldcam.tui.text.letters import BLOCK
from fieldcam.tui.text.news import news
from fieldcam.tui.widgets.buttons import BigButton
from fieldcam.tui.widgets.sizes_view import SizesView
from fieldcam.values import ReasonCode, Status, Verdict

SIZES = pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])
SAVED = SavedCapture("capture", Path("l"), Path("r"), Path("d"))


def screens_of(size: tuple[int, int], *states: WalkState) -> list[str]:
    """The texts of these states, one after the other."""
    shown: list[str] = []

    async def script(driven: Driven) -> None:
        for state in states:
            await driven.tell(state)
            shown.append(driven.text)

    drive(size, script)
    return shown


def screen_of(size: tuple[int, int], *told: LiveEvent | WalkState, keys: str = "") -> str:
    """The text after the walk told this and these keys were pressed."""
    shown: list[str] = []

    async def script(driven: Driven) -> None:
        await driven.tell(*told)
        await driven.press(*keys.split())
        shown.append(driven.text)

    drive(size, script)
    return shown[0]


@SIZES
def test_walk_screen(size: tuple[int, int], tmp_path: Path) -> None:
    states = {
        "accept": verdict(tmp_path, Status.ACCEPT),
        "confirm": verdict(tmp_path, Status.CONFIRM, ReasonCode.FEWER_THAN_BEFORE, 3),
        "retake": verdict(tmp_path, Status.RETAKE, ReasonCode.BLURRED),
    }
    for name, text in zip(states, screens_of(size, *states.values()), strict=True):
        check_golden(f"walk-{name}-{size[0]}x{size[1]}", text)


@SIZES
def test_route_screen(size: tuple[int, int]) -> None:
    check_golden(f"route-{size[0]}x{size[1]}", screen_of(size, AIM, keys="o"))


@SIZES
def test_help_screen(size: tuple[int, int]) -> None:
    text = screen_of(size, AIM, keys="question_mark")
    assert "Any key closes this page." in text and "SIMULATED" in text


@SIZES
def test_log_screen(size: tuple[int, int]) -> None:
    text = screen_of(size, Done("Tag 11 accepted."), Refused("Not now."), AIM, keys="l")
    assert re.search(r"\d\d:\d\d:\d\d  Tag 11 accepted\.\n \d\d:\d\d:\d\d  Not now\.", text)
    assert "SIMULATED" in text and "analysis starting" in text


@SIZES
def test_states_without_a_verdict(size: tuple[int, int], tmp_path: Path) -> None:
    saved = replace(AIM, shown=shown_with(tmp_path), waiting=1)
    words = {
        "Tag 12: aim, press Space. Last visit it had 5 fruitlets.": AIM,
        "Taking tag 12: hold still.": replace(AIM, camera=CameraState.EXPOSING),
        "The camera does not answer": replace(AIM, camera=CameraState.LOST),
        "Skipped: tag 22. O goes there": replace(AIM, tag_id=None, next_tag=None, progress=None),
        "Saved. It is being read": saved,
        "The analysis is off: I then R starts it again. It died.": replace(
            saved, analysis=AnalysisStatus(AnalysisState.STOPPED, last_error="It died.")
        ),
        "The analysis starts again and then reads it": replace(
            saved, analysis=AnalysisStatus(AnalysisState.RESTARTING)
        ),
        "1 to read, analysis off": replace(
            AIM, waiting=1, analysis=AnalysisStatus(AnalysisState.STOPPED)
        ),
        "1 skipped  1 not read  next 21": replace(AIM, failed=1),
        "Not read: It hung. I then R reads it again.": replace(
            AIM, shown=shown_with(tmp_path, failure="It hung.")
        ),
        "Tag 12 was accepted.": decided(tmp_path, Action.ACCEPT),
        "Take tag 12 again": decided(tmp_path, Action.RETAKE),
    }
    for expected, text in zip(words, screens_of(size, *words.values()), strict=True):
        assert expected in text


def ended(*states: ClusterState) -> WalkState:
    """No cluster is due; the route's clusters are in these states."""
    pairs = zip(ROUTE.stops, states, strict=True)
    stops = tuple(replace(stop, state=state) for stop, state in pairs)
    route = replace(ROUTE, stops=stops)
    return replace(AIM, tag_id=None, next_tag=None, progress=None, route=route)


@SIZES
def test_all_is_done_only_where_nothing_was_left_out(size: tuple[int, int]) -> None:
    done, skipped = ClusterState.ACCEPTED, ClusterState.SKIPPED
    undecided = ClusterState.UNDECIDED
    left_out, kept, not_decided = screens_of(
        size,
        ended(done, skipped, done, done),
        ended(*[done] * 4),
        ended(skipped, undecided, skipped, done),
    )
    assert "Skipped: tag 12. O goes there." in left_out and "3/4 taken, 1 skipped" in left_out
    assert "No cluster of this route needs a picture." in kept and "4/4 taken" in kept
    assert "skipped" not in kept
    assert "Skipped: tags 11, 21. Not decided: tag 12." in not_decided
    assert "2/4 taken, 2 skipped" in not_decided


def test_the_last_numbers_go_while_a_picture_is_taken(tmp_path: Path) -> None:
    state = replace(verdict(tmp_path, Status.ACCEPT), camera=CameraState.EXPOSING)
    assert "fruitlets" not in screen_of(SMALL, state)


def decided(folder: Path, action: Action) -> WalkState:
    return replace(AIM, shown=shown_with(folder, read(12), action=action))


def test_a_struck_fruitlet_is_marked(tmp_path: Path) -> None:
    state = replace(AIM, shown=shown_with(tmp_path, read(12), struck=(1,)))
    text = screen_of(SMALL, state)
    assert "B  struck out" in text and "4 fruitlets, last visit 5" in text


def test_bars_begin_below_each_other(tmp_path: Path) -> None:
    shown = shown_with(tmp_path, read(12, 7))
    reading = shown.record.reading
    assert reading is not None
    king, known, *others = reading.fruitlets
    crowned = (replace(king, marks=(MarkKind.KING,)), replace(known, sd_mm=0.114), *others)
    record = replace(shown.record, reading=replace(reading, fruitlets=crowned))
    text = screen_of(LARGE, replace(AIM, shown=replace(shown, record=record)))
    bars = [line for line in text.splitlines() if " mm " in line and BLOCK in line]
    assert len(bars) == 7 and "king" in bars[0] and " 10.00 mm ±0.11 " in bars[1]
    assert sum("±" in line for line in bars) == 1
    assert len({line.index(BLOCK, line.index(" mm ")) for line in bars}) == 1
    assert "7 fruitlets, 2 more than last visit" in text


def test_warnings_about_the_tag_are_said(tmp_path: Path) -> None:
    wrong = verdict(tmp_path, Status.RETAKE, ReasonCode.WRONG_TAG)
    text = screen_of(SMALL, replace(wrong, warnings=("Tag 11 is done already.",)))
    assert "It is wrong_tag. Tag 11 is done already." in text
    assert "tag BAD" in text and "depth good" in text


def test_what_is_not_marked_as_simulated_is_real() -> None:
    assert "SIMULATED" not in screen_of(SMALL, replace(AIM, simulated=False))


@pytest.mark.parametrize(
    ("free_bytes", "shown"),
    [
        (72_000_000_000, "72 GB free"),
        (1_000_000_000, "1 GB free"),
        (999_400_000, "999 MB free"),
        (0, "0 MB"),
    ],
)
def test_little_room_is_shown_in_megabytes(free_bytes: int, shown: str) -> None:
    assert shown in screen_of(SMALL, replace(AIM, free_bytes=free_bytes))


@pytest.mark.parametrize("size", [(40, 10), (79, 24), (80, 23)])
def test_a_window_that_is_too_small_says_so(size: tuple[int, int]) -> None:
    text = " ".join(screen_of(size, AIM).split())
    assert text == f"fieldcam needs a window of 80x24; this one is {size[0]}x{size[1]}."


def test_a_window_may_grow_and_shrink() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.pilot.resize_terminal(40, 10)
        await driven.settle()
        assert "needs a window" in driven.text
        await driven.pilot.resize_terminal(120, 40)
        await driven.settle()
        assert "aim, press Space" in driven.text

    drive(SMALL, script)


@pytest.mark.parametrize("opened", [(), ("v",), ("v", "t"), ("a",), ("o",), ("b",), ("b", "g")])
def test_no_key_works_unseen(tmp_path: Path, opened: tuple[str, ...]) -> None:
    keys = ("v", "b", "g", "t", "o", "a", "V", "0", "1", "pageup", "escape", "ctrl+p")

    async def script(driven: Driven) -> None:
        await driven.tell(verdict(tmp_path, Status.ACCEPT))
        await driven.press(*opened)
        screens = list(driven.app.screen_stack)
        await driven.pilot.resize_terminal(60, 15)
        await driven.settle()
        await driven.press(*KEYS, *keys)
        assert driven.app.screen_stack == screens
        assert "needs a window of 80x24" in driven.text
        await driven.press("question_mark")
        assert driven.app.screen_stack != screens
        await driven.press("x")
        await driven.pilot.resize_terminal(80, 24)
        await driven.settle()
        assert driven.walk.asked == []
        await driven.press("escape", "escape", "space")
        assert "needs a window" not in driven.text

    assert drive(SMALL, script).walk.asked == [Shoot()]


KEYS = {
    "space": Shoot(),
    "enter": Accept(),
    "r": Retake(),
    "backspace": Retake(),
    "s": SecondView(),
    "f": AnswerQuestion(Answer.FALLEN),
    "h": AnswerQuestion(Answer.HIDDEN),
    "c": OtherTarget(),
    "x": Strike(0),
    "k": SkipCluster(),
    "u": UndoLast(),
    "left": Step(-1),
    "right": Step(1),
    "w": NextTree(),
}


def test_each_key_is_one_command(tmp_path: Path) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(verdict(tmp_path, Status.ACCEPT))
        for key in KEYS:
            await driven.press(key)

    assert drive(SMALL, script).walk.asked == list(KEYS.values())


def test_arrows_choose_the_fruitlet_that_is_marked(tmp_path: Path) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(verdict(tmp_path, Status.ACCEPT))
        await driven.press("down", "down", "x", "up", "x", "up", "up", "x")

    asked = drive(SMALL, script).walk.asked
    assert asked == [Strike(2), Strike(1), Strike(4)]


def test_a_note_and_a_tag_are_typed(tmp_path: Path) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(verdict(tmp_path, Status.ACCEPT))
        await driven.press("n", *"a", "space", *"leaf", "enter")
        await driven.press("t", *"2x1", "enter")
        await driven.press("t", "5", "escape")
        assert not driven.app.screen.query(Input)

    assert drive(SMALL, script).walk.asked == [WriteNote("a leaf"), CorrectTag(21)]


def test_a_tag_is_not_asked_for_without_a_picture() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("t")
        assert "There is no picture of this cluster yet." in driven.text
        assert not driven.app.screen.query(Input)

    drive(SMALL, script)


@SIZES
def test_big_buttons_do_what_their_keys_do(size: tuple[int, int], tmp_path: Path) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(verdict(tmp_path, Status.ACCEPT))
        for action in ("shoot", "accept", "retake"):
            button = driven.app.screen.query_one(f"#do-{action}")
            assert button.size.height == 3
            await driven.pilot.click(f"#do-{action}")
        fewer = verdict(tmp_path, Status.CONFIRM, ReasonCode.FEWER_THAN_BEFORE, 3)
        await driven.tell(fewer)
        await driven.pilot.click("#do-hidden")
        await driven.settle()

    asked = drive(size, script).walk.asked
    assert asked == [Shoot(), Accept(), Retake(), AnswerQuestion(Answer.HIDDEN)]


def test_a_doubt_takes_no_key_that_was_meant_for_the_walk() -> None:
    """Enter twice at one cluster, or Space once too often, keeps nothing that nobody has seen."""
    insisted: list[str] = []
    doubt = Doubted("Keep it all the same?", lambda: insisted.append("yes"))

    async def script(driven: Driven) -> None:
        for answer in ("y", "Y", "n", "escape"):
            await driven.tell(AIM, doubt)
            for key in ("enter", "space", "r", "backspace"):
                await driven.press(key)
                assert "Keep it all the same?" in driven.text
            await driven.press(answer)
            assert "Keep it" not in driven.text

    assert drive(SMALL, script).walk.asked == []
    assert insisted == ["yes", "yes"]


def test_a_doubt_is_answered_by_mouse_too() -> None:
    insisted: list[str] = []

    async def script(driven: Driven) -> None:
        for button in range(2):
            await driven.tell(AIM, Doubted("Keep it?", lambda: insisted.append("yes")))
            await driven.pilot.click(driven.app.screen.query(BigButton)[button])
            await driven.settle()
            assert "Keep it?" not in driven.text

    drive(SMALL, script)
    assert insisted == ["yes"]


def test_a_question_goes_when_its_picture_has_a_verdict(tmp_path: Path) -> None:
    doubt = Doubted("There is no verdict on this picture. Keep it all the same?", lambda: None)

    async def script(driven: Driven) -> None:
        saved = replace(AIM, shown=shown_with(tmp_path))
        await driven.tell(saved, doubt, saved)
        assert "Keep it all the same?" in driven.text
        await driven.tell(verdict(tmp_path, Status.RETAKE, ReasonCode.BLURRED))
        assert "Keep it all the same?" not in driven.text
        assert "Nothing was done: there is news of the picture." in driven.text

    drive(SMALL, script)


def test_a_question_that_is_denied_is_told_so() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM, Doubted("Keep it?", lambda: None))
        await driven.press("escape")
        assert "Nothing was done." in driven.text

    drive(SMALL, script)


def test_the_verdict_of_an_earlier_picture_is_told_so(tmp_path: Path) -> None:
    state = replace(AIM, shown=shown_with(tmp_path))
    earlier = replace(SAVED, key="earlier")
    found = Verdict(Status.RETAKE)

    def told(of: SavedCapture) -> str:
        told = news(VerdictReady(of, 12, found, 6400.0), state)
        return "" if told is None else told.sentence

    assert told(earlier) == "An earlier picture of tag 12: RETAKE (6.4 s)."
    assert told(SAVED) == "Tag 12: RETAKE (6.4 s)."


def test_the_route_goes_to_any_cluster() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("o", "down", "enter")
        assert "aim, press Space" in driven.text

    assert drive(SMALL, script).walk.asked == [GoTo(22)]


def test_the_route_has_a_cursor_where_no_cluster_is_due() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(ended(*[ClusterState.ACCEPTED] * 4))
        await driven.press("o", "enter", "o", "down", "enter", "o", "left", "enter")
        assert "There is no cluster here: arrows choose one." in driven.text
        assert "cluster 1" in driven.text

    assert drive(SMALL, script).walk.asked == [GoTo(11), GoTo(21)]


def test_what_was_not_saved_stays_until_something_is() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(StorageTrouble(StorageFull("Only 3 MB are free.")), AIM)
        assert "NOT SAVED: Only 3 MB are free." in driven.text
        await driven.tell(AIM)
        assert "NOT SAVED" in driven.text
        await driven.tell(Saved(SAVED, 12, 12.0), AIM)
        assert "NOT SAVED" not in driven.text

    assert drive(SMALL, script).sound.played == [Tune.BAD]


def test_trouble_with_the_camera_is_said_and_heard() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(CameraTrouble(CameraUnplugged("No camera answers.", "Plug it in.")))
        assert "No camera answers. Plug it in." in driven.text

    assert drive(SMALL, script).sound.played == [Tune.BAD]


def test_one_key_switches_between_day_and_night() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("d")
        assert driven.app.theme == "fieldcam-light"
        await driven.press("d")
        assert driven.app.theme == "fieldcam-dark"

    drive(SMALL, script)


def test_a_missing_picture_leaves_the_numbers(tmp_path: Path) -> None:
    state = verdict(tmp_path, Status.ACCEPT)
    (tmp_path / "left.pgm").unlink()
    assert "5 fruitlets, last visit 5" in screen_of(SMALL, state)


@pytest.mark.parametrize("keys", [("question_mark", "z", "z"), ("question_mark", "z", "z", "z")])
def test_keys_that_come_too_late_for_a_page_take_no_other_away(keys: tuple[str, ...]) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.pilot.press(*keys)
        await driven.settle()
        assert isinstance(driven.app.screen, WalkScreen)
        await driven.press("question_mark")
        await driven.pilot.click("#keys", times=2)
        await driven.settle()
        assert isinstance(driven.app.screen, WalkScreen)

    drive(SMALL, script)


@pytest.mark.parametrize("keys", ["", "o", "l", "a", "v", "b", "i"])
def test_ctrl_c_says_which_key_ends_the_app(keys: str) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press(*keys, "ctrl+c")
        assert "Q ends the walk" in driven.text
        assert not driven.app.screen.query("Toast")

    drive(SMALL, script)


def test_letters_mean_the_same_with_caps_lock() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("F", "H", "U")
        assert driven.walk.asked == [
            AnswerQuestion(Answer.FALLEN),
            AnswerQuestion(Answer.HIDDEN),
            UndoLast(),
        ]

    drive(SMALL, script)


def test_bars_have_the_colours_of_the_theme_at_once(tmp_path: Path) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(verdict(tmp_path, Status.ACCEPT))
        for _ in range(2):
            await driven.press("d")
            theme = driven.app.current_theme
            drawn = bar_colours(driven.app.screen.query_one(SizesView))
            assert Color.parse(theme.foreground or "").hex in drawn
            assert Color.parse(theme.background or "").hex not in drawn

    drive(SMALL, script)


def bar_colours(sizes: SizesView) -> set[str]:
    """Of the bars that are drawn, as #RRGGBB."""
    segments = (each for y in range(sizes.size.height) for each in sizes.render_line(y))
    return {
        Color.from_rich_color(each.style.color).hex
        for each in segments
        if BLOCK in each.text and each.style is not None
    }


@pytest.mark.parametrize("keys", ["a", "question_mark"])
def test_no_screen_changes_how_another_one_looks(tmp_path: Path, keys: str) -> None:
    """Textual keeps the styles of every screen that was opened, for all that follow."""
    state = verdict(tmp_path, Status.ACCEPT)
    shown: list[str] = []

    async def first(driven: Driven) -> None:
        await driven.tell(state)
        await driven.press(keys)
        shown.append(driven.text)

    async def after_all_others(driven: Driven) -> None:
        await driven.tell(state)
        for others in (keys, "a", "o", "l", "v", "question_mark"):
            await driven.press(others, "escape")
        await driven.press(keys)
        shown.append(driven.text)

    drive(SMALL, first)
    drive(SMALL, after_all_others)
    assert shown[0] == shown[1]
