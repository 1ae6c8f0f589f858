"""What reaches widgets from other threads; nothing else may."""

from __future__ import annotations

from textual.message import Message

from fieldcam.session.events import LiveEvent


class Heard(Message):
    """The walk told something."""

    def __init__(self, event: LiveEvent) -> None:
        super().__init__()
        self.event = event
