"""What a word on one match has changed for other fruitlets; no widgets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from fieldcam.growth.places import Place, Track
from fieldcam.growth.records import Presence
from fieldcam.store.rows.fruit import AssociationWord
from fieldcam.tui.screens.pairs import Pair, PairRow, pair_rows
from fieldcam.tui.widgets.sketch import letter_in

ELSEWHERE = "fruitlets of other days were matched anew"
COUNTS_AS: dict[Presence | None, str] = {
    Presence.FALLEN: "counts as fallen now",
    Presence.NOT_SEEN: "counts as not seen now",
}


def places_of(words: Iterable[AssociationWord]) -> frozenset[Place]:
    """The fruitlets that the words are about."""
    ends = {(word.one_reading, word.one_fruitlet) for word in words}
    ends |= {
        (word.other_reading, word.other_fruitlet)
        for word in words
        if word.other_fruitlet is not None
    }
    return frozenset(Place(*end) for end in ends)


def told_changes(
    before: Sequence[Track], after: Sequence[Track], pair: Pair, said: frozenset[Place]
) -> str:
    """A sentence on all fruitlets but those that were `said`; empty where none has changed."""
    rows = pair_rows(before, pair), pair_rows(after, pair)
    told = list(_in_pair(*rows, pair, said))
    readings = {shown.record.reading.id for shown in pair if shown.record.reading is not None}
    if _outside(before, readings) != _outside(after, readings):
        told.append(ELSEWHERE)
    return f"Also changed: {'; '.join(told)}." if told else ""


def _in_pair(
    before: Sequence[PairRow], after: Sequence[PairRow], pair: Pair, said: frozenset[Place]
) -> Iterator[str]:
    known = {(row.one, row.other): row for row in before}
    for row in after:
        old = known.get((row.one, row.other))
        shown = [place for place in (row.one, row.other) if place is not None]
        letters = [
            letter_in(picture, place.fruitlet)
            for picture, place in zip(pair, (row.one, row.other), strict=True)
            if place is not None
        ]
        named = f"{row.number} ({letters[0]})"
        if old is None and len(shown) == 2 and not said.issuperset(shown):
            yield f"{named} is matched with {letters[1]} now"
        elif old is None and not said.issuperset(shown):
            yield f"{named} has no match any more"
        elif old is not None and len(shown) == 1 and old.presences[1] is not row.presences[1]:
            yield f"{named} {COUNTS_AS.get(row.presences[1], 'counts as seen now')}"


def _outside(tracks: Sequence[Track], readings: set[str]) -> set[frozenset[Place]]:
    """Which fruitlets of all other pictures are one."""
    return {
        frozenset(
            place
            for visit in track.visits.values()
            for place in visit.places
            if place.reading not in readings
        )
        for track in tracks
    } - {frozenset()}
