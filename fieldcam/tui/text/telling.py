"""What the Walk screen says of a state, as words and tones; no widgets."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from fieldcam.analysis.status import AnalysisState
from fieldcam.session.left_over import left_over, named_tags
from fieldcam.session.state import CameraState, Shown, Stage, WalkState
from fieldcam.session.summary import WalkSummary
from fieldcam.store.rows.judgements import Action
from fieldcam.values import ReasonCode, Status
from fieldcam.words import number_of


class Tone(StrEnum):
    """How something is meant; the theme has a colour for each."""

    GOOD = "good"
    ASK = "ask"
    BAD = "bad"
    BUSY = "busy"
    PLAIN = "plain"


@dataclass(frozen=True, slots=True)
class Banner:
    """One word in huge letters, with its shape and sentence."""

    word: str
    shape: str
    tone: Tone
    sentence: str


@dataclass(frozen=True, slots=True)
class QualityLight:
    """One of the four qualities of a picture; `good` is None while it is not known."""

    name: str
    good: bool | None


LIGHTS = {
    "tag": (
        ReasonCode.NO_TAG,
        ReasonCode.WRONG_TAG,
        ReasonCode.SEVERAL_TAGS,
        ReasonCode.TOO_NEAR,
        ReasonCode.TOO_FAR,
    ),
    "sharpness": (ReasonCode.BLURRED, ReasonCode.TOO_COARSE),
    "light": (ReasonCode.TOO_DARK, ReasonCode.OVEREXPOSED),
    "depth": (
        ReasonCode.TORN,
        ReasonCode.NO_DEPTH,
        ReasonCode.SWAPPED_EYES,
        ReasonCode.MISPAIRED,
        ReasonCode.CALIBRATION_DRIFT,
    ),
}
NOT_SAVED = "NOT SAVED"
READ_AGAIN = "I then R reads it again."


def banner(state: WalkState) -> Banner:
    """The most important thing now."""
    if state.camera is CameraState.EXPOSING:
        what = "a new tag" if state.tag_id is None else f"tag {state.tag_id}"
        sentence = f"Taking {what}: hold still. {state.patience}".rstrip()
        return Banner("TAKING", "dots", Tone.BUSY, sentence)
    if state.tag_id is None and state.shown is None and not state.learning:
        return all_done(state)
    if state.shown is None:
        return _before_the_picture(state)
    if state.shown.record.action is Action.ACCEPT:
        return Banner("DONE", "tick", Tone.GOOD, f"Tag {state.tag_id} was accepted.")
    if state.shown.record.action is Action.RETAKE:
        what = "it" if state.tag_id is None else f"tag {state.tag_id}"
        return Banner("AGAIN", "cross", Tone.BAD, f"Take {what} again: Space.")
    if state.shown.stage is Stage.READ:
        return _verdict(state, state.shown)
    return _without_reading(state, state.shown)


def all_done(state: WalkState) -> Banner:
    """Where no cluster is due: whether something was left out."""
    summary = "" if state.summary is None else summed_up(state.summary)
    if rest := left_over(state.route):
        parts = f"{rest} O goes there.", summary, "Q ends the walk.", state.afterwards
        return Banner("DONE", "query", Tone.ASK, " ".join(filter(None, parts)))
    needs = "No cluster of this route needs a picture."
    following = "" if state.summary is None else what_next(state.summary)
    told = needs, summary, following, "Q ends the walk.", state.afterwards
    return Banner("ALL DONE", "tick", Tone.GOOD, " ".join(filter(None, told)))


def summed_up(summary: WalkSummary) -> str:
    """Such as "Taken 8, retaken 1, skipped 0; missing: 2 fallen, 1 hidden; doubtful: tag 9."."""
    doubtful = f"doubtful: {named_tags(summary.doubtful)}" if summary.doubtful else "doubtful: none"
    missing = f"missing: {summary.fallen} fallen, {summary.hidden} hidden"
    counts = f"Taken {summary.taken}, retaken {summary.retaken}, skipped {summary.skipped}"
    return f"{counts}; {missing}; {doubtful}."


def what_next(summary: WalkSummary) -> str:
    """A forecast needs two visits."""
    if summary.visited_before:
        return "B, then G: how many will stay."
    return "Walk it again in some days, best three or more: then B and G say how many will stay."


def not_saved(sentence: str) -> Banner:
    """What the crew fears most, before everything else."""
    return Banner(NOT_SAVED, "cross", Tone.BAD, sentence)


def lights(shown: Shown | None) -> tuple[QualityLight, ...]:
    """What the verdict's reasons say about the picture."""
    if shown is None or shown.reading is None:
        return tuple(QualityLight(name, None) for name in LIGHTS)
    found = {reason.code for reason in shown.reading.verdict.reasons}
    unknown = _not_measured(found)
    return tuple(
        QualityLight(
            name, False if found.intersection(codes) else None if name in unknown else True
        )
        for name, codes in LIGHTS.items()
    )


def _not_measured(found: set[ReasonCode]) -> set[str]:
    """Without a tag there is no cluster whose depth counts; in the dark nothing is sharp."""
    if ReasonCode.NO_TAG not in found:
        return set()
    return {"depth", "sharpness"} if found.intersection(LIGHTS["light"]) else {"depth"}


def progress(state: WalkState) -> str:
    """Where the walk is, in one line."""
    route = state.route
    parts = [] if state.tag_id is None else [f"tag {state.tag_id}"]
    if (at := state.progress) is not None:
        parts.append(f"tree {at.tree}/{at.trees}, cluster {at.cluster}/{at.clusters}")
    elif state.learning and state.tree:
        parts.append(f"tree {state.tree}")
    skipped = f", {route.skipped} skipped" if route.skipped else ""
    parts.append(f"{route.taken}/{len(route.stops)} taken{skipped}")
    if state.waiting:
        off = ", analysis off" if state.analysis.state is AnalysisState.STOPPED else ""
        parts.append(f"{state.waiting} to read{off}")
    if state.failed:
        parts.append(f"{state.failed} not read")
    if state.next_tag not in (None, state.tag_id):
        parts.append(f"next {state.next_tag}")
    if state.seconds_per_cluster is not None:
        parts.append(f"{state.seconds_per_cluster:.0f} s a cluster")
    return "  ".join(parts)


def counted(state: WalkState) -> str:
    """Fruitlets of the target against the last visit, such as 5/6; empty before a reading."""
    if state.shown is None or state.shown.living is None:
        return ""
    return (
        f"{state.shown.living}" if state.before is None else f"{state.shown.living}/{state.before}"
    )


def sizes_heading(state: WalkState) -> str:
    """The target's count in words, with what no picture shows."""
    if state.shown is None or state.shown.living is None:
        return ""
    before = "" if state.before is None else f", last visit {state.before}"
    if state.before is not None and state.shown.living > state.before:
        before = f", {state.shown.living - state.before} more than last visit"
    marks = "".join(f", {mark.count} {mark.mark}" for mark in state.marks)
    return f"{number_of(state.shown.living, 'fruitlet')}{before}{marks}"


def _before_the_picture(state: WalkState) -> Banner:
    if state.camera is CameraState.LOST:
        usual = "The camera does not answer: check its cable, then press Space."
        sentence = state.camera_trouble or usual
        return Banner("CAMERA", "cross", Tone.BAD, sentence)
    if state.learning:
        tree = f" of tree {state.tree}" if state.tree else ""
        known = "No cluster that is known is left. " if state.route.stops else ""
        known += f"{summed_up(state.summary)} " if state.summary is not None else ""
        sentence = f"{known}Aim at a tag{tree}, press Space: it joins the route. W: next tree."
        return Banner("AIM", "none", Tone.PLAIN, sentence)
    before = ""
    if state.before is not None:
        before = f" Last visit it had {number_of(state.before, 'fruitlet')}."
    return Banner("AIM", "none", Tone.PLAIN, f"Tag {state.tag_id}: aim, press Space.{before}")


def _verdict(state: WalkState, shown: Shown) -> Banner:
    reasons = () if shown.reading is None else shown.reading.verdict.reasons
    sentence = " ".join([reason.text for reason in reasons] + list(state.warnings))
    if shown.status is Status.RETAKE:
        return Banner("RETAKE", "cross", Tone.BAD, sentence)
    if state.missing:
        told = f" {state.told} told." if state.told else ""
        question = f"{state.missing} fewer than last visit: fallen, or hidden by a leaf?{told}"
        return Banner("CONFIRM", "query", Tone.ASK, f"{question} 2 compares the days.")
    if state.more:
        asked = f"{state.more} more than last visit: hidden then, or not of this cluster?"
        answers = "Enter keeps all, X strikes the chosen one, 2 compares the days."
        return Banner("CONFIRM", "query", Tone.ASK, f"{asked} {answers}")
    if shown.status is Status.CONFIRM:
        return Banner("CONFIRM", "query", Tone.ASK, sentence)
    return Banner("ACCEPT", "tick", Tone.GOOD, sentence or "A good picture: Enter accepts it.")


def _without_reading(state: WalkState, shown: Shown) -> Banner:
    if shown.stage is Stage.FAILED:
        return Banner("NO SIZES", "query", Tone.ASK, f"Not read: {shown.failure} {READ_AGAIN}")
    if state.uncalibrated:
        return Banner("SAVED", "dots", Tone.ASK, state.uncalibrated)
    if state.analysis.state is AnalysisState.STOPPED:
        sentence = f"The analysis is off: I then R starts it again. {state.analysis.last_error}"
        return Banner("SAVED", "dots", Tone.ASK, sentence.rstrip())
    if state.analysis.state is AnalysisState.RESTARTING:
        sentence = "Saved. The analysis starts again and then reads it; you may walk on."
        return Banner("SAVED", "dots", Tone.BUSY, sentence)
    return Banner("SAVED", "dots", Tone.BUSY, "Saved. It is being read; you may walk on.")
