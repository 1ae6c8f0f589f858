"""The following app: the phone's layout as text, and that no key changes anything."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from live_walks import read
from made_cues import good_cue
from made_states import AIM, shown_with, verdict
from screens import check_golden, text_of
from textual.pilot import Pilot

from fieldcam.session.aim.cue import Cue
from fieldcam.session.events import Previewed
from fieldcam.session.following import NotAiming, NothingToFollow, Sight
from fieldcam.store.rows.judgements import Action
from fieldcam.tui.follow_app import FollowApp
from fieldcam.tui.screens.follow_screens import FollowScreen
from fieldcam.values import ReasonCode, Status

PHONE, TERMINAL = (48, 46), (80, 24)
"""Cells of a phone of 390x844 points held upright, and of a terminal."""


class Watching:
    """The app under a pilot, with sights made up."""

    def __init__(self) -> None:
        self.app, self.closed = FollowApp(self._start), False
        self.pilot: Pilot[None]

    async def see(self, sight: Sight) -> str:
        """The text once this is shown."""
        self._tell(sight)
        return await self.text()

    async def press(self, *keys: str) -> str:
        await self.pilot.press(*keys)
        return await self.text()

    async def text(self) -> str:
        await self.pilot.pause()
        await self.app.workers.wait_for_complete()
        await self.pilot.pause()
        return text_of(self.app)

    def close(self) -> None:
        self.closed = True

    def _start(self, tell: Callable[[Sight], None]) -> Watching:
        self._tell = tell
        return self


def watch(size: tuple[int, int], script: Callable[[Watching], Awaitable[None]]) -> Watching:
    """Run a script against the app in a terminal of this size."""

    async def run() -> Watching:
        watching = Watching()
        async with watching.app.run_test(size=size) as pilot:
            watching.pilot = pilot
            await script(watching)
        return watching

    return asyncio.run(run())


def seen(size: tuple[int, int], *sights: Sight) -> list[str]:
    """The texts of these sights, one after the other."""
    texts: list[str] = []

    async def script(watching: Watching) -> None:
        texts.extend([await watching.see(sight) for sight in sights])

    assert watch(size, script).closed
    return texts


def test_the_phones_layout(tmp_path: Path) -> None:
    sights: dict[str, Sight] = {
        "accept": verdict(tmp_path, Status.ACCEPT),
        "confirm": verdict(tmp_path, Status.CONFIRM, ReasonCode.FEWER_THAN_BEFORE, 3),
        "retake": verdict(tmp_path, Status.RETAKE, ReasonCode.BLURRED),
        "unseen": NothingToFollow("There is no data folder at /data. Name another with --data."),
    }
    for name, text in zip(sights, seen(PHONE, *sights.values()), strict=True):
        check_golden(f"phone-{name}-{PHONE[0]}x{PHONE[1]}", text)


def preview(cue: Cue) -> Previewed:
    return Previewed(np.full((90, 120), 90, np.uint8), cue)


def test_the_phones_layout_while_somebody_aims() -> None:
    text = seen(PHONE, AIM, preview(good_cue(12)))[1]
    check_golden(f"phone-aim-{PHONE[0]}x{PHONE[1]}", text)


def test_aiming_and_its_end_turn_the_page() -> None:
    async def script(watching: Watching) -> None:
        assert "Walk   North" in await watching.see(AIM)
        text = await watching.see(preview(good_cue(12, 800.0)))
        assert "Aim   North" in text and "800 mm: come closer." in text
        assert "Walk   North" in await watching.press("a")
        assert "Walk   North" in await watching.see(preview(good_cue(12)))
        await watching.pilot.click("#do-other_screen")
        assert "READY" not in await watching.see(AIM)
        assert "hold still" not in await watching.text()
        assert "Space takes the picture." in await watching.text()
        assert "no preview yet" in await watching.see(preview(good_cue(11)))
        assert "The disk is gone." in await watching.see(NothingToFollow("The disk is gone."))
        assert "no preview yet" in await watching.see(replace(AIM, tag_id=21))
        text = await watching.see(NotAiming())
        assert "Walk   North" in text and "Tag 21: aim, press Space." in text

    watch(PHONE, script)


def test_another_terminal_can_follow_too(tmp_path: Path) -> None:
    (text,) = seen(TERMINAL, verdict(tmp_path, Status.ACCEPT))
    check_golden(f"follow-accept-{TERMINAL[0]}x{TERMINAL[1]}", text)


WORDS: dict[str, Sight] = {
    "Tag 12: aim, press Space.": AIM,
    "Skipped: tag 22.": replace(AIM, tag_id=None, next_tag=None),
    "SIMULATED": AIM,
    "next 21": AIM,
}


@pytest.mark.parametrize("size", [PHONE, TERMINAL, (44, 30)], ids=["phone", "terminal", "least"])
def test_what_is_said_without_a_verdict(size: tuple[int, int], tmp_path: Path) -> None:
    words = {
        **WORDS,
        "Saved. It is being read": replace(AIM, shown=shown_with(tmp_path)),
        "Tag 12 was accepted.": replace(
            AIM, shown=shown_with(tmp_path, read(12), action=Action.ACCEPT)
        ),
    }
    for expected, text in zip(words, seen(size, *words.values()), strict=True):
        assert expected in " ".join(text.split())


def test_old_numbers_go_when_there_is_nothing_to_see(tmp_path: Path) -> None:
    before, gone, after = seen(
        PHONE, verdict(tmp_path, Status.ACCEPT), NothingToFollow("The disk is gone."), AIM
    )
    assert "9.00 mm" in before and "good" in before
    assert "The disk is gone." in gone
    assert "mm" not in gone and "good" not in gone and "next tag" not in gone
    assert "aim, press Space" in after


def test_a_window_that_is_too_small_says_so() -> None:
    (text,) = seen((43, 20), AIM)
    assert "needs a window of 44x20; this one is 43x20." in " ".join(text.split())


def test_no_key_changes_anything_but_the_colours(tmp_path: Path) -> None:
    async def script(watching: Watching) -> None:
        before = await watching.see(verdict(tmp_path, Status.ACCEPT))
        keys = "space enter r s f h t c x n k u o l v b i g left right up down ctrl+p ctrl+c escape"
        assert await watching.press(*keys.split()) == before
        assert await watching.press("d") == before
        assert watching.app.theme == "fieldcam-light"
        await watching.pilot.click("#do-switch_theme")
        assert watching.app.theme == "fieldcam-dark"
        assert isinstance(watching.app.screen, FollowScreen)

    watch(PHONE, script)


def test_it_ends_with_whoever_started_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fieldcam.tui.follow_app.ORPHAN_S", 0.01)

    async def script(watching: Watching) -> None:
        assert watching.app.is_running
        monkeypatch.setattr("os.getppid", lambda: 1 << 30)
        while not watching.app._exit:
            await watching.pilot.pause(0.01)

    assert watch(PHONE, script).closed
