"""What an event is worth: a sentence, whether it is bad, and a sound."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.session import events
from fieldcam.session.doubt import Instead
from fieldcam.session.state import WalkState
from fieldcam.tui.sound import Tune
from fieldcam.values import Status

INSTEAD = {
    Instead.ANSWER_OR_RETAKE: "F fallen, H hidden, or R retake",
    Instead.MARK_UNSEEN: "F and H are for those that no picture shows",
    Instead.COMPARE_DAYS: "T compares the days, F or H there answers",
    Instead.SAY_TAG_OR_RETAKE: "T says it, R retakes",
    Instead.RETAKE_OR_SAY_TAG: "R retakes, T says which it is",
    Instead.UNDO_ANSWER: "U on Walk takes the last answer back",
    Instead.UNDO_DECISION: "U on Walk takes that back",
    Instead.GIVE_TREES: "Set-up (E, Route) takes it from a CSV file",
}


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
        case events.Refused(sentence, instead):
            return News(refusal(sentence, instead), bad=True)
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


def refusal(sentence: str, instead: Instead | None) -> str:
    """Why a command was not carried out, and which keys help."""
    return sentence if instead is None else f"{sentence.removesuffix('.')}: {INSTEAD[instead]}."


def _name(tag_id: int | None) -> str:
    return "New tag" if tag_id is None else f"Tag {tag_id}"
