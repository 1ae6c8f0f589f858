"""Why a command of the operator is not simply carried out."""

from __future__ import annotations

from fieldcam.errors import BadInput


class NotNow(BadInput):
    """The command makes no sense here; the sentence says what does."""


class Doubtful(BadInput):
    """Most likely a slip, but the operator may insist."""
