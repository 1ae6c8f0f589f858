"""The operator's words on single fruit, as rows: caliper sizes, names, matches."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count

from fieldcam.growth.places import Word
from fieldcam.growth.records import fruit_name
from fieldcam.session.book import MOST_MM
from fieldcam.session.doubt import Doubtful, NotNow
from fieldcam.session.over_days.growing import word_row
from fieldcam.session.viewing import WalkView
from fieldcam.store.connection import rows
from fieldcam.store.queries.calipers import caliper_sizes, named_fruitlets, names_in
from fieldcam.store.queries.history import (
    CaptureRecord,
    FruitletSeen,
    ReadingSummary,
    capture_record,
)
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.rows import EntryId, Row
from fieldcam.store.rows.fruit import CaliperIdentity, CaliperSize

LONGEST_NAME = 20
FAR_MM = 3.0
FAR_SHARE = 1 / 3
"""A size by caliper that differs from the camera's by more than both is asked about."""


@dataclass(frozen=True, slots=True)
class FruitBook:
    """Words on fruit in pictures of any visit of the block; used by one thread."""

    view: WalkView

    def name_fruit(
        self,
        capture: EntryId,
        fruitlet: int,
        fruit: str,
        diameter_mm: float | None = None,
        insist: bool = False,
    ) -> str:
        """This fruitlet is the fruit of this name, with this size by caliper on that day.

        Without a name it keeps the one that it has, else gets the cluster's next free number.
        What is most likely a slip is done only on insisting.
        """
        if diameter_mm is not None and not 0 < diameter_mm <= MOST_MM:
            raise NotNow(f"A fruitlet measures between 0 and {MOST_MM:g} mm.")
        record, reading = self._read(capture)
        living = {seen.id: seen for seen in reading.target if seen.living}
        if fruitlet not in living:
            raise NotNow("Choose a fruitlet of the list first.")
        if record.tag_id is None or record.day is None:
            raise NotNow("Which tag this picture shows is not known yet.")
        names = names_in(self.view.store.database, reading.id)
        typed = fruit_name(" ".join(fruit.split()))
        name = typed or names.get(fruitlet) or self._next_number(record.tag_id)
        if len(name) > LONGEST_NAME or not name.isprintable():
            raise NotNow(f"A fruit's name has at most {LONGEST_NAME} letters.")
        doubts = [
            *_doubts_on_name(
                reading, {each: names[each] for each in living if each in names}, fruitlet, name
            ),
            *_doubts_on_size(reading, living[fruitlet], diameter_mm),
        ]
        if doubts and not insist:
            raise Doubtful(" ".join(doubts))
        written: list[Row] = [CaliperIdentity(reading.id, fruitlet, name)]
        if diameter_mm is not None:
            size = CaliperSize(self._block, record.tag_id, record.day, name, diameter_mm)
            written.append(size)
        self.view.store.append(*written)
        measured = "" if diameter_mm is None else f", {diameter_mm:.2f} mm by caliper"
        return f"Fruitlet {reading.letter(fruitlet)} is called {name}{measured}."

    def match(self, word: Word) -> str:
        """The operator's word on which fruitlet of one picture is which of another."""
        row = word_row(word)
        if row.one_reading == row.other_reading:
            raise NotNow("A match is one of two pictures.")
        self._check(row.one_reading, row.one_fruitlet)
        self._check(row.other_reading, row.other_fruitlet)
        self.view.store.append(row)
        return "Matched by hand." if word.other is not None else "Unmatched by hand."

    @property
    def _block(self) -> EntryId:
        block: EntryId = row_of(self.view.store.database, "visit", self.view.visit)["block"]
        return block

    def _read(self, capture: EntryId) -> tuple[CaptureRecord, ReadingSummary]:
        record = capture_record(self.view.store.database, capture)
        if record is None or record.reading is None:
            raise NotNow("This picture has no reading.")
        return record, record.reading

    def _check(self, reading: EntryId, fruitlet: int | None) -> None:
        """What a match is about must be there still: the picture may have been read again."""
        found = rows(self.view.store.database, "SELECT capture FROM reading WHERE id = ?", reading)
        _, now = self._read(found[0]["capture"] if found else "")
        ids = [None, *(seen.id for seen in now.fruitlets)]
        if now.id != reading or fruitlet not in ids:
            raise NotNow("The picture was read again meanwhile: look again.")

    def _next_number(self, tag_id: int) -> str:
        database, block = self.view.store.database, self._block
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
