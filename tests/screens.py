"""Drives the real app with a walk that only notes, and reads its screens as text."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from fieldcam.session.set_up.setting_up import SetUp
from made_states import NotedWalk
from textual.app import App
from textual.pilot import Pilot
from textual.widgets import Input
from textual.worker import WorkerCancelled

from fieldcam.session.events import Changed, Listener, LiveEvent
from fieldcam.session.state import WalkState
from fieldcam.tui.app import USUAL_LOOK, FieldcamApp
from fieldcam.tui.looks import Look
from fieldcam.tui.sound import Tune
from fieldcam.tui.trick import Trick

SMALL, LARGE = (80, 24), (120, 40)
GOLDEN = Path(__file__).parent / "golden"
WRITE = "FIELDCAM_WRITE_GOLDEN"


@dataclass
class Heard:
    """A sound that only remembers."""

    played: list[Tune] = field(default_factory=list)

    def play(self, tune: Tune) -> None:
        self.played.append(tune)


class Driven:
    """The app under a pilot."""

    def __init__(
        self,
        setup: SetUp | None = None,
        lines: Sequence[str] = (),
        look: Look = USUAL_LOOK,
    ) -> None:
        self.walk, self.sound = NotedWalk(), Heard()
        self.tricks: list[str] = []
        self.started = 0
        self.app = FieldcamApp(
            self._start,
            self.sound,
            lines,
            [Trick("Camera: trick", "Tricks it", self._trick)],
            look=look,
            setup=setup,
        )
        self.pilot: Pilot[None]

    async def tell(self, *events: LiveEvent | WalkState) -> None:
        """As the walk's threads do, and until it is shown."""
        for event in events:
            self._listener(Changed(event) if isinstance(event, WalkState) else event)
        await self.settle()

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)
        await self.settle()

    async def type(self, text: str) -> None:
        """Into the field that has the focus, over what stands there."""
        self.pilot.app.screen.query_one("Input:focus", Input).value = text
        await self.press("enter")

    async def settle(self) -> None:
        await self.pilot.pause()
        # A look-up that another one has overtaken is cancelled while it is waited for.
        with suppress(WorkerCancelled):
            await self.app.workers.wait_for_complete()
        await self.app.workers.wait_for_complete()
        await self.pilot.pause()

    @property
    def text(self) -> str:
        return text_of(self.app)

    def _trick(self) -> str:
        self.tricks.append("trick")
        return "The camera was tricked."

    def _start(self, listener: Listener) -> NotedWalk:
        self._listener = listener
        self.started += 1
        return self.walk


def drive(
    size: tuple[int, int],
    script: Callable[[Driven], Awaitable[None]],
    look: Look = USUAL_LOOK,
    setup: SetUp | None = None,
    lines: Sequence[str] = (),
) -> Driven:
    """Run a script against the app in a terminal of this size."""

    async def run() -> Driven:
        driven = Driven(setup, lines, look)
        async with driven.app.run_test(size=size) as pilot:
            driven.pilot = pilot
            await driven.settle()
            await script(driven)
        return driven

    return asyncio.run(run())


def text_of(app: App[None]) -> str:
    """What the terminal shows, without colours."""
    strips = app.screen._compositor.render_strips()
    return "\n".join(strip.text.rstrip() for strip in strips) + "\n"


def walk_text(size: tuple[int, int], state: WalkState) -> str:
    """What the Walk screen shows of a state."""
    seen: list[str] = []

    async def script(driven: Driven) -> None:
        await driven.tell(state)
        seen.append(driven.text)

    drive(size, script)
    return seen[0]


def check_golden(name: str, text: str) -> None:
    """Compare with the file of this name; FIELDCAM_WRITE_GOLDEN=1 writes it anew."""
    path = GOLDEN / f"{name}.txt"
    if os.environ.get(WRITE):
        GOLDEN.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")
