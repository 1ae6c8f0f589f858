"""What the Aim screen says of a cue, as words and tones; no widgets."""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.session.aim.automatic import Automatic
from fieldcam.session.aim.cue import Cue, Zone
from fieldcam.session.state import CameraState, WalkState
from fieldcam.tui.text.telling import Banner, Tone, all_done
from fieldcam.values import BEST_RANGE_MM, FARTHEST_MM, NEAREST_MM

SHOWN_MM = (200.0, 700.0)
"""Of the range bar, from end to end."""
OUTSIDE, WORKING, BEST = ".", "=", "█"
ENDS = ("near ", " far")


@dataclass(frozen=True, slots=True)
class CueLine:
    """One of the things that must be right; `good` is None while it is not known."""

    name: str
    found: str
    good: bool | None


def aim_banner(state: WalkState, cue: Cue | None, automatic: Automatic) -> Banner:
    """The one thing to do next."""
    if state.tag_id is None and not state.learning:
        return all_done(state)
    if state.camera is CameraState.EXPOSING:
        return Banner("TAKING", "dots", Tone.BUSY, f"Taking {_named(state.tag_id)}: hold still.")
    if state.camera is CameraState.LOST:
        usual = "The camera does not answer: check its cable. It is found by itself."
        sentence = state.camera_trouble or usual
        return Banner("CAMERA", "cross", Tone.BAD, sentence)
    if cue is None or cue.due != state.tag_id:
        waiting = f"{_named(state.tag_id).capitalize()}: no preview yet."
        return Banner("WAIT", "dots", Tone.BUSY, waiting)
    return _of_cue(cue) or Banner("READY", "tick", Tone.GOOD, _ready(state, cue, automatic))


def cue_lines(cue: Cue | None) -> tuple[CueLine, ...]:
    """Tag, range, stillness, flash."""
    if cue is None:
        return tuple(CueLine(name, "", None) for name in ("tag", "range", "still", "flash"))
    return (
        _tag_line(cue),
        CueLine("range", _range(cue), None if cue.zone is None else cue.zone is Zone.GOOD),
        CueLine("still", _moved(cue), cue.still),
        CueLine("flash", "ready" if cue.flash_ready else "charging", cue.flash_ready),
    )


def range_bar(range_mm: float | None, width: int) -> tuple[str, str]:
    """A line with a mark at the tag's range, and the bar below it: working range and its best."""
    length = max(1, width - sum(map(len, ENDS)))
    lowest, highest = SHOWN_MM
    middles = [lowest + (n + 0.5) * (highest - lowest) / length for n in range(length)]
    bar = "".join(_cell(middle_mm) for middle_mm in middles)
    if range_mm is None:
        return "", ENDS[0] + bar + ENDS[1]
    share = (range_mm - lowest) / (highest - lowest)
    place = len(ENDS[0]) + min(length - 1, max(0, int(share * length)))
    return " " * place + "▼", ENDS[0] + bar + ENDS[1]


def automatic_line(state: WalkState, automatic: Automatic) -> str:
    """Whether it fires by itself here."""
    if not automatic.on:
        return "Automatic off: Space takes it."
    if state.tag_id is None:
        return "Automatic ON, but not for new tags: Space."
    if not automatic.may(state):
        return "Automatic ON, but this one was taken: Space."
    return "Automatic ON: fires when all is good."


def _of_cue(cue: Cue) -> Banner | None:
    """What is not right, the first thing first."""
    if cue.problem:
        return Banner("AIM", "dots", Tone.BUSY, f"{cue.problem} Space takes the picture.")
    if cue.due is None:
        return _of_new_tag(cue) or _of_place(cue)
    if not cue.read:
        return Banner("NO TAG", "query", Tone.ASK, f"Tag {cue.due} is due: bring it into view.")
    if cue.due not in cue.read:
        seen = ", ".join(str(tag_id) for tag_id in cue.read)
        return Banner("WRONG", "cross", Tone.BAD, f"Tag {seen} is in view, {cue.due} is due.")
    if not cue.in_view:
        return Banner("WRONG", "cross", Tone.BAD, f"Tag {cue.due} is in view twice.")
    return _of_place(cue)


def _of_new_tag(cue: Cue) -> Banner | None:
    """Where a new cluster is to be learned."""
    if not cue.read:
        return Banner("NO TAG", "query", Tone.ASK, "Bring a tag into view: it joins the route.")
    if not cue.in_view:
        return Banner("WHICH", "query", Tone.ASK, "Several tags are in view: show one of them.")
    return None


def _of_place(cue: Cue) -> Banner | None:
    if cue.zone is None:
        sentence = "The range is not known: is the camera calibrated? Space takes the picture."
        return Banner("RANGE", "query", Tone.ASK, sentence)
    if cue.zone is Zone.NEAR:
        return Banner("NEAR", "cross", Tone.ASK, f"{_range(cue)}: go back a little.")
    if cue.zone is Zone.FAR:
        return Banner("FAR", "cross", Tone.ASK, f"{_range(cue)}: come closer.")
    if not cue.still:
        return Banner("HOLD", "query", Tone.ASK, "Hold still.")
    if not cue.flash_ready:
        return Banner("FLASH", "dots", Tone.BUSY, "The flash is charging.")
    return None


def _named(tag_id: int | None) -> str:
    return "a new tag" if tag_id is None else f"tag {tag_id}"


def _ready(state: WalkState, cue: Cue, automatic: Automatic) -> str:
    if state.tag_id is None:
        return f"Tag {cue.read[0]}: Space takes the picture, and it joins the route."
    if automatic.on and automatic.may(state):
        return f"Tag {state.tag_id}: hold it so, it fires by itself."
    return f"Tag {state.tag_id}: Space takes the picture."


def _tag_line(cue: Cue) -> CueLine:
    due = "" if cue.due is None else f", due {cue.due}"
    if cue.problem:
        return CueLine("tag", f"not read{due}", None)
    seen = " ".join(str(tag_id) for tag_id in cue.read) or "none"
    return CueLine("tag", f"read {seen}{due}", cue.in_view)


def _range(cue: Cue) -> str:
    return "" if cue.range_mm is None else f"{cue.range_mm:.0f} mm"


def _moved(cue: Cue) -> str:
    return "" if cue.moved_mm is None else f"moved {cue.moved_mm:.0f} mm"


def _cell(middle_mm: float) -> str:
    if not NEAREST_MM <= middle_mm <= FARTHEST_MM:
        return OUTSIDE
    return BEST if BEST_RANGE_MM[0] <= middle_mm <= BEST_RANGE_MM[1] else WORKING
