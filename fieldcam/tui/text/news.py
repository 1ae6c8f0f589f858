"""What an event is worth: a sentence, whether it is bad, and a sound."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.session import events
from fieldcam.session.state import WalkState
from fieldcam.tui.sound import Tune
from fieldcam.values import Status


@dataclass(frozen=True, slots=True)
class News:
    """One line for the operator."""

    sentence: str
    bad: bool = False
    tune: Tune | None = None
    unsaved: bool = False
    """Something could not be written."""


def news(event: events.LiveEvent, state: WalkState | None = None) -> News | None:
    """None where the event only changes what is shown; `state` is the last one that was."""
    match event:
        case events.Done(sentence):
            return News(sentence)
        case events.Refused(sentence):
            return News(sentence, bad=True)
        case events.Damaged(sentence):
            return News(sentence, bad=True, tune=Tune.BAD)
        case events.Saved(_, tag_id, duration_ms):
            return News(f"{_name(tag_id)} saved ({duration_ms:.0f} ms).")
        case events.VerdictReady(capture, tag_id, verdict, duration_ms, more):
            asks = more > 0 and verdict.status is Status.ACCEPT
            status = Status.CONFIRM if asks else verdict.status
            tune = Tune.GOOD if status is Status.ACCEPT else Tune.BAD
            took = f"{duration_ms / 1000:.1f} s"
            shown = None if state is None else state.shown
            newer = shown is not None and shown.record.tag_id == tag_id and shown.id != capture.key
            name = f"An earlier picture of tag {tag_id}" if newer else _name(tag_id)
            return News(f"{name}: {status.upper()} ({took}).", tune=tune)
        case events.AnalysisTrouble(_, tag_id, error):
            return News(f"{_name(tag_id)}: {error}", bad=True, tune=Tune.BAD)
        case events.CameraReady(missed, notes):
            last = (f"The last picture was not taken: {missed}",) if missed else ()
            return News(" ".join(("The camera is ready.", *last, *notes)))
        case events.CameraTrouble(error):
            return News(str(error), bad=True, tune=Tune.BAD)
        case events.StorageTrouble(error):
            return News(f"NOT SAVED: {error}", bad=True, tune=Tune.BAD, unsaved=True)
        case _:
            return None


def _name(tag_id: int | None) -> str:
    return "New tag" if tag_id is None else f"Tag {tag_id}"
