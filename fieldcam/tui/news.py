"""What an event is worth: a sentence, whether it is bad, and a sound."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.session import events
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


def news(event: events.LiveEvent) -> News | None:
    """None where the event only changes what is shown."""
    match event:
        case events.Done(sentence):
            return News(sentence)
        case events.Refused(sentence):
            return News(sentence, bad=True)
        case events.Saved(_, tag_id, duration_ms):
            return News(f"{_name(tag_id)} saved ({duration_ms:.0f} ms).")
        case events.VerdictReady(_, tag_id, verdict, duration_ms):
            tune = Tune.GOOD if verdict.status is Status.ACCEPT else Tune.BAD
            took = f"{duration_ms / 1000:.1f} s"
            return News(f"{_name(tag_id)}: {verdict.status.upper()} ({took}).", tune=tune)
        case events.AnalysisTrouble(_, tag_id, error):
            return News(f"{_name(tag_id)}: {error}", bad=True, tune=Tune.BAD)
        case events.CameraReady(missed, notes):
            last = ("The last picture was not taken.",) if missed else ()
            return News(" ".join(("The camera is ready.", *last, *notes)))
        case events.CameraTrouble(error):
            return News(str(error), bad=True, tune=Tune.BAD)
        case events.StorageTrouble(error):
            return News(f"NOT SAVED: {error}", bad=True, tune=Tune.BAD, unsaved=True)
        case _:
            return None


def _name(tag_id: int | None) -> str:
    return "New tag" if tag_id is None else f"Tag {tag_id}"
