"""Why a command of the operator is not simply carried out."""

from __future__ import annotations

from fieldcam.errors import BadInput


class NotNow(BadInput):
    """The command makes no sense here; the sentence says what does."""


class NewDay(BadInput):
    """The calendar has gone on since the visit was opened; the sentence asks what is walked."""


class Doubtful(BadInput):
    """Most likely a slip, but the operator may insist."""
