"""Two pictures of one cluster and which fruitlet is which; no widgets."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, product

from fieldcam.growth.grown import Growth, sd_of_difference
from fieldcam.growth.noise import NOISE
from fieldcam.growth.places import MatchWord, Place, Track, TrackedVisit
from fieldcam.growth.records import Presence, SizeSource
from fieldcam.growth.warnings.doubts import SURE, Doubt, growth_doubt
from fieldcam.session.state import Shown
from fieldcam.store.rows.fruit import AssociationWord, MissingWord
from fieldcam.store.rows.judgements import Answer
from fieldcam.store.rows.row import EntryId
from fieldcam.tui.widgets.sketch import letter_in, living
from fieldcam.values import Fruitlet
from fieldcam.words import give_or_take

Pair = tuple[Shown, Shown]
"""The earlier picture and the later one."""
IN_ANOTHER = "in another picture"
NEITHER = "Neither of the two pictures shows a fruitlet of this cluster."
NO_FRUIT = {Doubt.GROWTH: "grows", Doubt.SHRUNK: "shrinks"}
MIN_WIDTH = 9
"""Of a column of sizes."""


@dataclass(frozen=True, slots=True)
class PairRow:
    """One fruitlet in two pictures, or in one of them."""

    number: int
    """The track's, which the report and the tables name too."""
    one: Place | None
    """In the earlier picture."""
    other: Place | None
    sizes_mm: tuple[float | None, float | None]
    presences: tuple[Presence | None, Presence | None]
    """What became of it on the two days; None before the first day on which it was seen."""
    confidence: float
    """Of the match, where both pictures show it."""
    by_hand: bool
    """The operator's word made or confirmed the match, or said that there is none."""
    told: Answer | None = None
    """What the operator said of one that the later picture does not show."""
    sds_mm: tuple[float | None, float | None] = (None, None)
    """Standard deviations of the two sizes; None where unknown."""

    @property
    def doubtful(self) -> bool:
        return self.confidence < SURE and not self.by_hand

    @property
    def missing(self) -> bool:
        """The later picture does not show it."""
        return self.other is None

    def growth(self, elapsed_days: int) -> Growth | None:
        """None without two sizes, or where both pictures are of one day."""
        one, other = self.sizes_mm
        if one is None or other is None or not elapsed_days:
            return None
        return Growth(one, other, elapsed_days, sd_of_difference(*self.sds_mm))


def pairs_of(days: Sequence[Sequence[Shown]]) -> tuple[tuple[Pair, ...], ...]:
    """For each two visits on end their pairs of pictures: across the days, then within one.

    `days` are the pictures of each visit that has any, the earliest first.
    """
    if len(days) == 1:
        within = tuple(combinations(days[0], 2))
        return (within,) if within else ()
    return tuple(
        (*product(one, other), *combinations(one, 2), *combinations(other, 2))
        for one, other in pairwise(days)
    )


def pair_rows(
    tracks: Sequence[Track],
    pair: Pair,
    words: Sequence[AssociationWord] = (),
    told: Sequence[MissingWord] = (),
) -> tuple[PairRow, ...]:
    """The fruitlets that one of the pictures shows, in the order of their tracks.

    `words` are the operator's, by which a fruitlet may have no match; `told` are the answers
    on the later day.
    """
    answers = {Place(word.reading, word.fruitlet): word.answer for word in told}
    rows = [row for track in tracks if (row := _row(track, pair)) is not None]
    alone = {
        (Place(word.one_reading, word.one_fruitlet), word.other_reading)
        for word in words
        if word.other_fruitlet is None
    }
    return tuple(
        replace(
            row,
            by_hand=row.by_hand or _unmatched(row, pair, alone),
            told=_told(row, tracks, answers),
        )
        for row in rows
    )


def unplaced(tracks: Sequence[Track], pair: Pair) -> tuple[tuple[Fruitlet, ...], ...]:
    """What each picture shows that has no depth: it can be nobody of the other day."""
    known = {place for track in tracks for visit in track.visits.values() for place in visit.places}
    return tuple(
        tuple(
            fruitlet
            for fruitlet in living(shown)
            if shown.record.reading is not None
            and Place(shown.record.reading.id, fruitlet.id) not in known
        )
        for shown in pair
    )


def said_word(rows: Sequence[PairRow], chosen: int, number: int, pair: Pair) -> MatchWord | None:
    """That the chosen fruitlet is the one of row `number`; 0: that the other shows none.

    None where there is nothing to say: no such row, or not one of each picture.
    """
    here = next((row for row in rows if row.number == chosen), None)
    there = next((row for row in rows if row.number == number), None)
    if here is None or (number and there is None):
        return None
    if there is not None:
        one, other = here.one or there.one, there.other if here.one else here.other
        return None if one is None or other is None else MatchWord(one, other)
    later, earlier = pair[1].record.reading, pair[0].record.reading
    if here.one is not None and later is not None:
        return MatchWord(here.one, None, later.id)
    if here.other is not None and earlier is not None:
        return MatchWord(here.other, None, earlier.id)
    return None


def pair_lines(
    rows: Sequence[PairRow],
    pair: Pair,
    chosen: int,
    alone: Sequence[Sequence[Fruitlet]] = ((), ()),
    asked: bool = False,
) -> Iterator[str]:
    """A table: sizes of both days, growth, and how sure the match is.

    `alone` are each picture's fruitlets without depth; `asked`: what is missing in the later
    picture waits for an answer.
    """
    if not rows and not any(alone):
        yield NEITHER
        return
    days = [f"{shown.record.day:%d %b}" for shown in pair]
    sizes = [_sizes(row, pair) for row in rows]
    width = max([MIN_WIDTH, *(len(size) for of_row in sizes for size in of_row)])
    yield f"      {days[0]:>{width}}  {days[1]:>{width}}   mm a day"
    elapsed = _elapsed(pair)
    for row, (one, other) in zip(rows, sizes, strict=True):
        mark = ">" if row.number == chosen else " "
        growth = row.growth(elapsed)
        said = _asked(row) if asked and row.missing else _said(row, days[0], growth)
        grown = f"{one:>{width}}  {other:>{width}}   {_rate(growth):8}"
        yield f"{mark}{row.number:3}  {grown} {said}".rstrip()
    for day, shown, fruitlets in zip(days, pair, alone, strict=True):
        for fruitlet in fruitlets:
            letter = letter_in(shown, fruitlet.id)
            yield f"   ?  {letter} on {day} has no depth: it may be any of these"


def _row(track: Track, pair: Pair) -> PairRow | None:
    one, other = (_place(track, shown) for shown in pair)
    if one is None and other is None:
        return None
    earlier, later = (_visit(track, shown) for shown in pair)
    first, second = _fruitlet(pair[0], one), _fruitlet(pair[1], other)
    return PairRow(
        track.number,
        one,
        other,
        (_diameter(first), _diameter(second)),
        (
            None if earlier is None else earlier.sighting.presence,
            None if later is None else later.sighting.presence,
        ),
        1.0 if later is None or one is None or other is None else later.sighting.confidence,
        one is not None and other is not None and later is not None and later.by_hand,
        sds_mm=(
            None if first is None else first.sd_mm,
            None if second is None else second.sd_mm,
        ),
    )


def _unmatched(row: PairRow, pair: Pair, alone: Collection[tuple[Place, EntryId]]) -> bool:
    """Whether the operator said that the other picture does not show it."""
    earlier, later = (shown.record.reading for shown in pair)
    if row.one is None and row.other is not None and earlier is not None:
        return (row.other, earlier.id) in alone
    if row.other is None and row.one is not None and later is not None:
        return (row.one, later.id) in alone
    return False


def _visit(track: Track, shown: Shown) -> TrackedVisit | None:
    day = shown.record.day
    return None if day is None else track.visits.get(day)


def _place(track: Track, shown: Shown) -> Place | None:
    reading, visit = shown.record.reading, _visit(track, shown)
    if reading is None or visit is None:
        return None
    return next((place for place in visit.places if place.reading == reading.id), None)


def _fruitlet(shown: Shown, place: Place | None) -> Fruitlet | None:
    if shown.reading is None or place is None:
        return None
    return next((each for each in shown.reading.fruitlets if each.id == place.fruitlet), None)


def _diameter(fruitlet: Fruitlet | None) -> float | None:
    return None if fruitlet is None else fruitlet.diameter_mm


def _elapsed(pair: Pair) -> int:
    one, other = (shown.record.day for shown in pair)
    return 0 if one is None or other is None else (other - one).days


def _sizes(row: PairRow, pair: Pair) -> tuple[str, str]:
    one, other = (
        _size(shown, place, size, sd)
        for shown, place, size, sd in zip(
            pair, (row.one, row.other), row.sizes_mm, row.sds_mm, strict=True
        )
    )
    return one, other


def _size(shown: Shown, place: Place | None, diameter_mm: float | None, sd_mm: float | None) -> str:
    if place is None:
        return "-"
    size = "no size" if diameter_mm is None else f"{diameter_mm:5.2f}{give_or_take(sd_mm)}"
    return f"{letter_in(shown, place.fruitlet)} {size}"


def _rate(growth: Growth | None) -> str:
    return "" if growth is None else f"{growth.rate_mm_per_day:+.2f}"


def _said(row: PairRow, first_day: str, growth: Growth | None) -> str:
    if row.one is not None and row.other is not None:
        doubt = None if growth is None else growth_doubt(growth, NOISE[SizeSource.CAMERA])
        if doubt in NO_FRUIT:
            return f"? no fruit {NO_FRUIT[doubt]} so"
        if row.by_hand:
            return "by hand"
        return f"? {row.confidence:.0%} sure" if row.doubtful else ""
    by_hand = ", by hand" if row.by_hand else ""
    return f"{_missing(row, first_day)}{by_hand}"


def _asked(row: PairRow) -> str:
    """Of a picture that is not decided: what was told, else what the picture says itself."""
    if row.told is not None:
        return f"{row.told}, told by hand"
    empty = row.presences[1] is Presence.FALLEN
    looks = "its place looks empty" if empty else "something may hide it"
    return f"missing: {looks}"


def _told(row: PairRow, tracks: Sequence[Track], answers: Mapping[Place, Answer]) -> Answer | None:
    """Whichever of its earlier pictures the answer was given on."""
    track = next(track for track in tracks if track.number == row.number)
    places = (place for visit in track.visits.values() for place in visit.places)
    return next((answers[place] for place in places if place in answers), None)


def _missing(row: PairRow, first_day: str) -> str:
    words = {Presence.FALLEN: "fallen", Presence.NOT_SEEN: "not seen", None: "not seen before"}
    if row.one is None:
        missing = words.get(row.presences[0], IN_ANOTHER)
        return f"{missing} on {first_day}" if missing == words[Presence.NOT_SEEN] else missing
    return words.get(row.presences[1], IN_ANOTHER)
