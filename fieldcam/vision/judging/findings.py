"""One thing that speaks against a capture, and what it asks for."""

from __future__ import annotations

from fieldcam.values import Reason, ReasonCode, Status

Finding = tuple[Status, Reason]


def retake(code: ReasonCode, text: str) -> Finding:
    return Status.RETAKE, Reason(code, text)


def confirm(code: ReasonCode, text: str) -> Finding:
    return Status.CONFIRM, Reason(code, text)
