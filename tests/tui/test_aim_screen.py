"""The Aim screen: what it says of a look, what fires, and when it looks at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_cues import good_cue, tag
from made_states import AIM, ROUTE, shown_with, verdict
from screens import LARGE, SMALL, Driven, check_golden, drive

from fieldcam.errors import CameraUnplugged, StorageFull
from fieldcam.session.aim.automatic import Automatic
from fieldcam.session.aim.cue import Cue
from fieldcam.session.commands import Shoot, SkipCluster, Step, UndoLast
from fieldcam.session.events import CameraReady, CameraTrouble, Previewed, Saved, StorageTrouble
from fieldcam.session.state import CameraState, WalkState
from fieldcam.store.captures import SavedCapture
from fieldcam.store.queries.walks import ClusterState
from fieldcam.tui.remote import shutter_keys
from fieldcam.tui.screens.aim_screen import AimScreen
from fieldcam.tui.screens.walk_screen import WalkScreen
from fieldcam.tui.text.aim_telling import BEST, OUTSIDE, WORKING, aim_banner, cue_lines, range_bar
from fieldcam.tui.text.letters import big, shape
from fieldcam.tui.widgets.banner_view import GAP
from fieldcam.values import FARTHEST_MM, NEAREST_MM, ImageU8, Status

SIZES = pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])
PICTURE: ImageU8 = np.full((360, 480), 90, np.uint8)
SAVED = SavedCapture("capture", Path("l"), Path("r"), Path("d"))
DUE = 12
GOOD = good_cue(DUE)


def seen(cue: Cue) -> Previewed:
    return Previewed(PICTURE, cue)


@SIZES
def test_aim_screen(size: tuple[int, int]) -> None:
    shown: list[str] = []

    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("a")
        await driven.tell(seen(GOOD))
        shown.append(driven.text)

    drive(size, script)
    check_golden(f"aim-{size[0]}x{size[1]}", shown[0])


CUES: dict[str, Cue] = {
    "Space takes the picture.": GOOD,
    "Tag 12 is due: bring it into view.": Cue(DUE),
    "Tag 3, 17 is in view, 12 is due.": Cue(DUE, (3, 17)),
    "Tag 12 is in view twice.": Cue(DUE, (DUE, DUE)),
    "250 mm: go back a little.": good_cue(DUE, 250.0),
    "640 mm: come closer.": good_cue(DUE, 640.0),
    "The range is not known: is the camera calibrated?": replace(
        GOOD, place_mm=None, moved_mm=None
    ),
    "Hold still.": replace(GOOD, moved_mm=30.0),
    "The flash is charging.": replace(GOOD, flash_ready=False),
    "The analysis is off. Space takes": Cue(DUE, problem="The analysis is off."),
    "Tag 12: no preview yet.": good_cue(11),
}


COLUMNS = 46
"""For the cue on the smallest screen."""


@pytest.mark.parametrize("sentence", CUES)
def test_the_cue_says_what_to_do_next(sentence: str) -> None:
    banner = aim_banner(AIM, CUES[sentence], Automatic())
    assert sentence in banner.sentence
    assert len(big(banner.word)[0]) + len(GAP) + len(shape(banner.shape)[0]) <= COLUMNS


LEARNING = replace(AIM, tag_id=None, next_tag=None, learning=True)
NEW_TAGS: dict[str, Cue] = {
    "Bring a tag into view: it joins the route.": Cue(None),
    "Several tags are in view: show one of them.": Cue(None, (3, 17)),
    "250 mm: go back a little.": replace(good_cue(17, 250.0), due=None),
    "Tag 17: Space takes the picture, and it joins the route.": replace(good_cue(17), due=None),
    "A new tag: no preview yet.": good_cue(17),
}


@pytest.mark.parametrize("sentence", NEW_TAGS)
def test_a_new_cluster_is_aimed_at_as_a_known_one_is(sentence: str) -> None:
    banner = aim_banner(LEARNING, NEW_TAGS[sentence], Automatic())
    assert sentence in banner.sentence
    found = [line.found for line in cue_lines(NEW_TAGS[sentence])]
    assert "None" not in " ".join([banner.sentence, *found])
    assert len(big(banner.word)[0]) + len(GAP) + len(shape(banner.shape)[0]) <= COLUMNS


STATES: dict[str, WalkState] = {
    "Taking a new tag: hold still.": replace(LEARNING, camera=CameraState.EXPOSING),
    "check its cable. It is found by itself.": replace(AIM, camera=CameraState.LOST),
    "Taking tag 12: hold still.": replace(AIM, camera=CameraState.EXPOSING),
    "Skipped: tag 22. O goes there.": replace(AIM, tag_id=None, next_tag=None),
}


@pytest.mark.parametrize("sentence", STATES)
def test_states_of_camera_and_walk_go_first(sentence: str) -> None:
    banner = aim_banner(STATES[sentence], GOOD, Automatic())
    assert sentence in banner.sentence
    assert len(big(banner.word)[0]) + len(GAP) + len(shape(banner.shape)[0]) <= COLUMNS


@pytest.mark.parametrize("width", [20, 44, 70])
def test_the_bar_shows_the_working_range_and_its_best(width: int) -> None:
    mark, bar = range_bar(438.0, width)
    assert len(bar) == width
    assert bar[mark.index("▼")] == BEST
    places = {range_mm: range_bar(range_mm, width)[0].index("▼") for range_mm in (100, 330, 900)}
    assert [bar[place] for place in places.values()] == [OUTSIDE, WORKING, OUTSIDE]
    assert range_bar(None, width) == ("", bar)
    assert NEAREST_MM < 330 < FARTHEST_MM


def test_the_camera_is_looked_through_only_while_the_screen_is_on_top() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        for key, looking in {
            "a": 1, "question_mark": 0, "x": 1, "o": 0, "escape": 1, "g": 1,
        }.items():  # fmt: skip
            await driven.press(key)
            assert driven.walk.previews == looking, key
        await driven.press("escape")
        assert driven.walk.previews == 0
        assert isinstance(driven.app.screen, WalkScreen)
        await driven.tell(seen(GOOD))

    drive(SMALL, script)


def test_remotes_take_the_picture_on_both_screens() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("pagedown", "raise_volume", "a")
        await driven.press("space", "pageup", "pagedown", "lower_volume")

    assert drive(SMALL, script).walk.asked == [Shoot()] * 6


def test_a_remotes_key_can_be_learned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FIELDCAM_SHUTTER_KEYS", "f5, f6")
    assert set(shutter_keys("z").split(",")) >= {"space", "pagedown", "f5", "f6", "z"}

    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("f5", "z")
        for learned in ("z", "escape"):
            driven.app.action_learn_key()
            await driven.settle()
            assert "Press the remote's button." in driven.text
            await driven.press(learned)
        assert "FIELDCAM_SHUTTER_KEYS=z keeps it" in driven.text
        await driven.press("z", "f6", "space")

    assert drive(SMALL, script).walk.asked == [Shoot()] * 4


def test_arrows_and_big_buttons_work_here_too() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("a", "left", "right", "k", "u")
        await driven.pilot.click("#do-shoot")
        await driven.pilot.click("#do-automatic")
        await driven.settle()
        assert "Automatic ON" in driven.text
        await driven.pilot.click("#do-walk")
        await driven.settle()
        assert isinstance(driven.app.screen, WalkScreen)

    asked = drive(SMALL, script).walk.asked
    assert asked == [Step(-1), Step(1), SkipCluster(), UndoLast(), Shoot()]


def test_it_fires_by_itself_when_that_is_switched_on() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("a")
        assert "Automatic off" in driven.text
        await driven.tell(*[seen(GOOD)] * 3)
        assert not driven.walk.asked
        await driven.press("g")
        assert "Automatic ON: fires when all is good." in driven.text
        await driven.tell(*[seen(GOOD)] * 5)
        assert driven.walk.asked == [Shoot()]
        assert "Automatic ON, but this one was taken: Space." in driven.text
        await driven.press("g")
        assert "Automatic off" in driven.text

    drive(SMALL, script)


def test_nothing_fires_behind_another_screen() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("a", "g", "question_mark")
        await driven.tell(*[seen(GOOD)] * 5)

    assert not drive(SMALL, script).walk.asked


@pytest.mark.parametrize(
    "event", [Saved(SAVED, DUE, 9.0), StorageTrouble(StorageFull("3 MB are free."))]
)
def test_what_came_of_the_picture_is_on_the_walk_screen(event: Saved | StorageTrouble) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("a")
        await driven.tell(event)
        assert isinstance(driven.app.screen, WalkScreen)
        assert driven.walk.previews == 0

    drive(SMALL, script)


def test_a_camera_that_is_lost_and_found_is_said_where_one_aims() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("a")
        trouble = CameraTrouble(CameraUnplugged("The camera is unplugged.", "Check its cable."))
        await driven.tell(trouble, replace(AIM, camera=CameraState.LOST))
        assert "The camera is unplugged. Check its cable." in driven.text
        assert "The camera does not answer" in driven.text
        assert "▀" not in driven.text and "440 mm" not in driven.text
        await driven.tell(CameraReady(missed="The camera is unplugged."), AIM, seen(GOOD))
        assert "The last picture was not taken: The camera is unplugged." in driven.text
        assert "Space takes the picture." in driven.text

    drive(SMALL, script)


@pytest.mark.parametrize("automatic", [True, False])
def test_after_an_acceptance_automatic_aiming_goes_on(tmp_path: Path, automatic: bool) -> None:
    stops = tuple(
        replace(stop, state=ClusterState.ACCEPTED) if stop.tag_id == DUE else stop
        for stop in ROUTE.stops
    )
    following = replace(AIM, tag_id=21, route=replace(ROUTE, stops=stops))

    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        if automatic:
            await driven.press("a", "g", "escape")
        await driven.tell(verdict(tmp_path, Status.ACCEPT), following)
        assert isinstance(driven.app.screen, AimScreen if automatic else WalkScreen)
        assert driven.walk.previews == automatic

    drive(SMALL, script)


def test_a_cluster_with_a_picture_is_aimed_at_without_firing(tmp_path: Path) -> None:
    state = replace(AIM, shown=shown_with(tmp_path))

    async def script(driven: Driven) -> None:
        await driven.tell(state)
        await driven.press("a", "g")
        await driven.tell(*[seen(GOOD)] * 4)
        assert "this one was taken" in driven.text

    assert not drive(SMALL, script).walk.asked


def test_the_preview_may_be_grey_or_in_colour() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("a")
        for picture in (PICTURE, np.repeat(PICTURE[..., None], 3, axis=2)):
            await driven.tell(Previewed(picture, replace(GOOD, place_mm=tag(DUE).translation_mm)))
            assert driven.text.count("▀") > 30 * 12

    drive(SMALL, script)


def test_a_camera_without_hardware_has_its_tricks_in_the_palette() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("ctrl+p", *"trick")
        assert "Tricks it" in driven.text
        await driven.press("enter")
        await driven.settle()
        assert "The camera was tricked." in driven.text

    assert drive(SMALL, script).tricks == ["trick"]
