"""An app that nobody touches does nothing: the battery must last a day."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path

from live_walks import read
from made_states import AIM, shown_with
from screens import SMALL, Driven, drive


def timers() -> int:
    """How many things the event loop is to do later of its own accord."""
    scheduled = getattr(asyncio.get_running_loop(), "_scheduled")  # noqa: B009 (untyped)
    return sum(not handle.cancelled() for handle in scheduled)


def test_an_idle_app_waits_for_no_timer(tmp_path: Path) -> None:
    async def script(driven: Driven) -> None:
        for state in (AIM, replace(AIM, shown=shown_with(tmp_path, read(12)))):
            await driven.tell(state)
            assert timers() == 0
        driven.app.set_interval(60, driven.app.refresh)
        await driven.settle()
        assert timers() == 1, "this test does not see a timer"

    drive(SMALL, script)
