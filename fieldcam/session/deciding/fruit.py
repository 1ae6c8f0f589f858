"""The operator's words on single fruit: caliper sizes, names, matches, the king."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import count

from fieldcam.growth.places import MatchWord
from fieldcam.growth.records import fruit_name
from fieldcam.session.commands import NameFruit
from fieldcam.session.deciding.here import read_picture
from fieldcam.session.doubt import Doubtful, NotNow
from fieldcam.session.over_days.growing import word_row
from fieldcam.session.viewing import WalkView
from fieldcam.store.connection import rows
from fieldcam.store.queries.calipers import caliper_sizes, named_fruitlets, names_in
from fieldcam.store.queries.history import FruitletSeen, ReadingSummary
from fieldcam.store.rows.fruit import CaliperIdentity, CaliperSize
from fieldcam.store.rows.judgements import FruitletMark, MarkKind
from fieldcam.store.rows.row import EntryId, Row

MAX_MM = 100.0
"""No apple in its first weeks is larger."""
LONGEST_NAME = 20
FAR_MM = 3.0
FAR_SHARE = 1 / 3
"""A size by caliper that differs from the camera's by more than both is asked about."""


def name_fruit(view: WalkView, said: NameFruit, insist: bool) -> str:
    """What is most likely a slip is done only on insisting."""
    if said.diameter_mm is not None:
        _check_size(said.diameter_mm)
    record, reading = read_picture(view, said.capture)
    living = {seen.id: seen for seen in reading.target if seen.living}
    if said.fruitlet not in living:
        raise NotNow("Choose a fruitlet of the list first.")
    if record.tag_id is None or record.day is None:
        raise NotNow("Which tag this picture shows is not known yet.")
    names = names_in(view.store.database, reading.id)
    typed = fruit_name(" ".join(said.fruit.split()))
    name = typed or names.get(said.fruitlet) or _next_number(view, record.tag_id)
    if len(name) > LONGEST_NAME or not name.isprintable():
        raise NotNow(f"A fruit's name has at most {LONGEST_NAME} letters.")
    of_living = {each: names[each] for each in living if each in names}
    doubts = [
        *_doubts_on_name(reading, of_living, said.fruitlet, name),
        *_doubts_on_size(reading, living[said.fruitlet], said.diameter_mm),
    ]
    if doubts and not insist:
        raise Doubtful(" ".join(doubts))
    written: list[Row] = [CaliperIdentity(reading.id, said.fruitlet, name)]
    measured = ""
    if said.diameter_mm is not None:
        block, day = view.route().block, record.day
        written.append(CaliperSize(block, record.tag_id, day, name, said.diameter_mm))
        measured = f", {said.diameter_mm:.2f} mm by caliper"
    view.store.append(*written)
    return f"Fruitlet {reading.letter(said.fruitlet)} is called {name}{measured}."


def match_fruit(view: WalkView, word: MatchWord) -> str:
    """Both pictures must still have the readings that the word is about."""
    row = word_row(word)
    if row.one_reading == row.other_reading:
        raise NotNow("A match is one of two pictures.")
    _check_read(view, row.one_reading, row.one_fruitlet)
    _check_read(view, row.other_reading, row.other_fruitlet)
    view.store.append(row)
    return "Matched by hand." if word.other is not None else "Unmatched by hand."


def crown_king(view: WalkView, capture: EntryId, fruitlet: int) -> str:
    """One of the target's living fruitlets."""
    _, reading = read_picture(view, capture)
    if not any(f.id == fruitlet and f.in_target and f.living for f in reading.fruitlets):
        raise NotNow("Choose a fruitlet of the list first.")
    view.store.append(FruitletMark.on_fruitlet(MarkKind.KING, reading.id, fruitlet))
    return f"Fruitlet {reading.letter(fruitlet)} is the king."


def add_by_hand(view: WalkView, capture: EntryId, diameter_mm: float) -> str:
    """It counts as one that the picture shows."""
    _, reading = read_picture(view, capture)
    _check_size(diameter_mm)
    view.store.append(
        FruitletMark(MarkKind.ADDED_BY_HAND, reading=reading.id, diameter_mm=diameter_mm)
    )
    return f"Added by hand: {diameter_mm:.2f} mm."


def _check_size(diameter_mm: float) -> None:
    if not 0 < diameter_mm <= MAX_MM:
        raise NotNow(f"A fruitlet measures between 0 and {MAX_MM:g} mm.")


def _check_read(view: WalkView, reading: EntryId, fruitlet: int | None) -> None:
    """What a match is about must be there still: the picture may have been read again."""
    found = rows(view.store.database, "SELECT capture FROM reading WHERE id = ?", reading)
    _, now = read_picture(view, found[0]["capture"] if found else "")
    ids = [None, *(seen.id for seen in now.fruitlets)]
    if now.id != reading or fruitlet not in ids:
        raise NotNow("The picture was read again meanwhile: look again.")


def _next_number(view: WalkView, tag_id: int) -> str:
    database, block = view.store.database, view.route().block
    used = {size.fruit for size in caliper_sizes(database, block) if size.tag_id == tag_id}
    used |= {seen.fruit for seen in named_fruitlets(database, block) if seen.tag_id == tag_id}
    return next(name for n in count(1) if (name := str(n)) not in used)


def _doubts_on_name(
    reading: ReadingSummary, names: Mapping[int, str], fruitlet: int, name: str
) -> Iterator[str]:
    """`names` are those of the picture's fruitlets that live."""
    here = reading.letter(fruitlet)
    if names.get(fruitlet, name) != name:
        yield f"{here} is called {names[fruitlet]} already. Is it called {name} from now on?"
    others = (n for n, said in names.items() if said == name and n != fruitlet)
    if there := next(map(reading.letter, others), ""):
        yield f"{there} is called {name} already. Is it {here} that is, and {there} not?"


def _doubts_on_size(
    reading: ReadingSummary, seen: FruitletSeen, calipers_mm: float | None
) -> Iterator[str]:
    camera_mm = seen.diameter_mm
    if calipers_mm is None or camera_mm is None:
        return
    if abs(calipers_mm - camera_mm) > max(FAR_MM, FAR_SHARE * camera_mm):
        yield (
            f"The camera measured {camera_mm:.2f} mm on {reading.letter(seen.id)}."
            f" Is it {calipers_mm:.2f} mm by caliper?"
        )
