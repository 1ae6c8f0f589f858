"""What the Cluster screen says of pictures, days and words; no widgets."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import timedelta
from statistics import mean

from fieldcam.growth.warnings.doubts import MAX_MM_PER_DAY
from fieldcam.session.over_days.days import ClusterDay
from fieldcam.store.queries.history import CaptureRecord, ReadingSummary
from fieldcam.store.queries.said import StandingWord
from fieldcam.store.rows.fruit import AssociationWord, CaliperIdentity, CaliperSize
from fieldcam.store.rows.judgements import (
    Action,
    Answer,
    Decision,
    FruitletMark,
    MarkKind,
    Note,
    Skip,
    TagCorrection,
    TargetCorrection,
)
from fieldcam.store.rows.row import EntryId, Row
from fieldcam.words import letter_of, number_of

DECIDED = {
    Action.ACCEPT: "accepted",
    Action.RETAKE: "to be taken again",
    Action.DISCARD: "discarded",
    None: "not decided: Enter goes to Walk",
}
MARKED = {
    MarkKind.FALLEN: "fallen",
    MarkKind.HIDDEN: "hidden",
    MarkKind.KING: "king",
    MarkKind.NOT_A_FRUITLET: "struck out",
    MarkKind.ADDED_BY_HAND: "added by hand",
}


def picture_line(record: CaptureRecord, place: int, count: int) -> str:
    """Which picture is shown; `place` counts from 1."""
    verdict = "no sizes" if record.reading is None else record.reading.status.upper()
    # What decides comes first: a small terminal cuts the end.
    parts = [f"Picture {place}/{count}", verdict, DECIDED[record.action], _when(record)]
    if record.retake_of is not None:
        parts.append("retake")
    if record.view > 1:
        parts.append(f"view {record.view}")
    return "   ".join(parts)


def _when(record: CaptureRecord) -> str:
    """On the day of its visit, whatever a wrong clock said; a walk may go on past midnight."""
    taken, of_visit = record.taken_at.date(), record.day
    wrong = of_visit is not None and not timedelta(0) <= taken - of_visit <= timedelta(days=1)
    return f"{of_visit if wrong else taken:%d %b} {record.taken_at:%H:%M}"


def picture_heading(record: CaptureRecord) -> str:
    """Above the sizes of one picture."""
    reading = record.reading
    return "No sizes yet" if reading is None else number_of(reading.living, "fruitlet")


def day_lines(days: Sequence[ClusterDay]) -> Iterator[str]:
    """Count, mean and its growth since the day before, then the sizes and the marks."""
    if days:
        yield "Mean by day (~: of unlike counts)"
    before: ClusterDay | None = None
    for day in days:
        growth = "" if before is None else _growth(before, day)
        yield f"{day.day:%d %b}  {_counted(day)}{growth}"
        details = "  ".join([*_sizes(day), *_marks(day)])
        if details:
            yield f"  {details}"
        if day.sizes_mm:
            before = day


Readings = Mapping[EntryId, ReadingSummary]
"""The last one of each picture, by its id."""


def word_line(word: StandingWord, places: Mapping[EntryId, int], readings: Readings) -> str:
    """One line of what was said; `places` counts the pictures from 1."""
    who = f" {word.who}" if word.who else ""
    place = places.get(word.capture or "")
    picture = "" if place is None else f", picture {place}"
    why = f" ({word.why})" if word.why else ""
    return f"{word.at:%d %b %H:%M}{who}{picture}: {_said(word.saying, readings)}{why}"


def _counted(day: ClusterDay) -> str:
    if not day.counted:
        return "no accepted picture"
    sizes = day.sizes_mm
    return f"{day.fruitlets}: {mean(sizes):.2f} mm" if sizes else f"{day.fruitlets}: no sizes"


def _growth(before: ClusterDay, day: ClusterDay) -> str:
    """Of unlike counts it can only be said roughly, as those that fell were small."""
    elapsed = (day.day - before.day).days
    if not day.sizes_mm or not elapsed:
        return ""
    roughly = "" if len(day.sizes_mm) == len(before.sizes_mm) else "~"
    rate = (mean(day.sizes_mm) - mean(before.sizes_mm)) / elapsed
    odd = " (no fruit grows so)" if rate > MAX_MM_PER_DAY else ""
    return f", {roughly}{rate:+.2f} a day{odd}"


def _sizes(day: ClusterDay) -> list[str]:
    return [" ".join(f"{size:.1f}" for size in day.sizes_mm)] if day.sizes_mm else []


def _marks(day: ClusterDay) -> list[str]:
    """Those on the cluster, then those on fruitlets of the pictures that count."""
    found = [f"{mark.count} {MARKED[mark.mark]}" for mark in day.marks]
    most: Counter[MarkKind] = Counter()
    for picture in day.counted:
        if (reading := picture.reading) is not None:
            marks = Counter(mark for fruitlet in reading.fruitlets for mark in fruitlet.marks)
            # Two pictures show the same fruitlets.
            most |= marks + Counter({MarkKind.ADDED_BY_HAND: len(reading.by_hand_mm)})
    return [*found, *(f"{count} {MARKED[mark]}" for mark, count in most.items())]


def _said(saying: Row, readings: Readings) -> str:
    match saying:
        case Decision(_, action, answer):
            return DECIDED[action] + _answer(answer)
        case FruitletMark():
            return _mark(saying, readings)
        case TagCorrection(_, tag_id):
            return f"is of tag {tag_id}"
        case TargetCorrection(_, cluster):
            return f"cluster {cluster + 1} is the target"
        case Note(text):
            return f"note: {text}"
        case Skip():
            return "skipped"
        case CaliperSize(_, _, day, fruit, diameter_mm):
            return f"{fruit} has {diameter_mm:.2f} mm by caliper on {day:%d %b}"
        case CaliperIdentity(reading, fruitlet, fruit):
            return f"fruitlet {_letter(readings, reading, fruitlet)} is called {fruit}"
        case AssociationWord(reading, fruitlet, there, other):
            partner = "not in" if other is None else f"{_letter(readings, there, other)} of"
            return f"fruitlet {_letter(readings, reading, fruitlet)} is {partner} another picture"
        case _:
            return saying.named


def _answer(answer: Answer | None) -> str:
    return "" if answer is None else f", fewer as {answer}"


def _mark(mark: FruitletMark, readings: Readings) -> str:
    word = MARKED[mark.mark]
    if mark.diameter_mm is not None:
        return f"{word} with {mark.diameter_mm:.2f} mm"
    if mark.fruitlet is None:
        return f"{mark.count} {word}"
    return f"fruitlet {_letter(readings, mark.reading or '', mark.fruitlet)} {word}"


def _letter(readings: Readings, reading: EntryId, fruitlet: int) -> str:
    """Of a picture that was read again since, by its number in the reading before."""
    known = readings.get(reading)
    return letter_of(fruitlet) if known is None else known.letter(fruitlet)
