"""One thing that speaks against a capture, and what it asks for."""

from __future__ import annotations

from fieldcam.values import Reason, ReasonCode, Status

Finding = tuple[Status, Reason]

NEAREST_MM, FARTHEST_MM = 300.0, 600.0
"""Of the tag: the working range that the operator is told."""


def retake(code: ReasonCode, text: str) -> Finding:
    return Status.RETAKE, Reason(code, text)


def confirm(code: ReasonCode, text: str) -> Finding:
    return Status.CONFIRM, Reason(code, text)
