"""What reaches widgets from other threads; nothing else may."""

from __future__ import annotations

from collections.abc import Callable

from textual.message import Message

from fieldcam.session.events import LiveEvent


class Heard(Message):
    """The walk told something."""

    def __init__(self, event: LiveEvent) -> None:
        super().__init__()
        self.event = event


class LookedUp(Message):
    """What a screen wanted from the store was read."""

    def __init__(self, show: Callable[[], None]) -> None:
        super().__init__()
        self.show = show


class WalkEnded(Message):
    """The walk before was closed, and the next one may begin."""
