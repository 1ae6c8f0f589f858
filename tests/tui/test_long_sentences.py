"""Sentences that are longer than a line are shown whole, and all keys below them."""

from __future__ import annotations

import errno
from dataclasses import replace

import pytest
import usb.core
from made_states import AIM, ROUTE
from screens import LARGE, SMALL, Driven, drive

from fieldcam.analysis.status import AnalysisState, AnalysisStatus
from fieldcam.camera.usb3vision.usb_faults import device_error
from fieldcam.session.calibrating import MISSING
from fieldcam.session.events import CameraReady, CameraTrouble, LiveEvent
from fieldcam.session.state import CameraState, WalkState
from fieldcam.store.queries.walks import ClusterState
from fieldcam.tui.text.news import news
from fieldcam.tui.text.telling import progress

SIZES = pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])
FORBIDDEN = device_error(usb.core.USBError("denied", errno=errno.EACCES))
"""The longest sentence about a camera, with the rule that the operator has to copy."""
EVENTS: list[LiveEvent] = [
    CameraTrouble(FORBIDDEN),
    CameraReady(
        "The camera sent no picture in time.",
        (
            "SN-40512345 is taken for the left camera, SN-40512346 for the right one:"
            " camera.toml names none.",
            "The camera has no feature LineSource. (SN-40512345)",
            "SN-40512346 is in a USB 2 port or on a USB 2 cable: each picture takes longer.",
            MISSING,
        ),
    ),
]
SCREENS = ("escape", "a", "v", "t", "b", "g", "i")
LOST = replace(AIM, camera=CameraState.LOST, camera_trouble=str(FORBIDDEN))
LEFT_OUT = replace(
    AIM,
    route=replace(
        ROUTE, stops=tuple(replace(stop, state=ClusterState.SKIPPED) for stop in ROUTE.stops)
    ),
    waiting=12,
    failed=13,
    seconds_per_cluster=25.0,
    analysis=AnalysisStatus(AnalysisState.STOPPED),
)
STATES: list[tuple[WalkState, str]] = [(LOST, str(FORBIDDEN)), (LEFT_OUT, progress(LEFT_OUT))]


@SIZES
def test_every_screen_that_tells_events_tells_them_whole(size: tuple[int, int]) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        for key in SCREENS:
            await driven.press("escape", key)
            keys = footer(driven)
            for event in EVENTS:
                await driven.tell(event)
                told = news(event)
                assert told is not None and spaced(told.sentence) in spaced(driven.text)
                assert footer(driven) == keys

    drive(size, script)


@SIZES
@pytest.mark.parametrize(("state", "sentence"), STATES, ids=["lost", "progress"])
def test_a_state_is_told_whole(size: tuple[int, int], state: WalkState, sentence: str) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        keys = footer(driven)
        await driven.tell(state)
        assert spaced(sentence) in spaced(driven.text)
        assert footer(driven) == keys

    drive(size, script)


def footer(driven: Driven) -> str:
    return driven.text.splitlines()[-1]


def spaced(text: str) -> str:
    """Its words, wherever lines end."""
    return " ".join(text.split())


@SIZES
def test_a_long_name_of_a_block_leaves_room_for_the_day(size: tuple[int, int]) -> None:
    named = replace(AIM, block="Row 5, 3 clusters, walked without a screen", simulated=True)

    async def script(driven: Driven) -> None:
        await driven.tell(named)
        for key in SCREENS:
            await driven.press("escape", key)
            bar = driven.text.splitlines()[0]
            assert f"{AIM.day:%d %b %Y}" in bar and bar.endswith("free")

    drive(size, script)
