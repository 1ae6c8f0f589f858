"""The operator's words on single fruit, as rows: caliper sizes, names, matches."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count

from fieldcam.growth.places import Word
from fieldcam.growth.records import fruit_name
from fieldcam.session.book import MOST_MM
from fieldcam.session.doubt import Doubtful, NotNow
from fieldcam.session.growing import word_row
from fieldcam.session.viewing import WalkView
from fieldcam.store.calipers import caliper_sizes, named_fruitlets, names_in
from fieldcam.store.connection import rows
from fieldcam.store.fruit_rows import CaliperIdentity, CaliperSize
from fieldcam.store.history import CaptureRecord, ReadingSummary, capture_record
from fieldcam.store.lookups import row_of
from fieldcam.store.rows import EntryId, Row
from fieldcam.words import letter_of

LONGEST_NAME = 20


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
        A name that another fruitlet of the picture has is taken over only on insisting.
        """
        if diameter_mm is not None and not 0 < diameter_mm <= MOST_MM:
            raise NotNow(f"A fruitlet measures between 0 and {MOST_MM:g} mm.")
        record, reading = self._read(capture)
        if not any(seen.id == fruitlet and seen.living for seen in reading.target):
            raise NotNow("Choose a fruitlet of the list first.")
        if record.tag_id is None or record.day is None:
            raise NotNow("Which tag this picture shows is not known yet.")
        names = names_in(self.view.store.database, reading.id)
        typed = fruit_name(" ".join(fruit.split()))
        name = typed or names.get(fruitlet) or self._next_number(record.tag_id)
        if len(name) > LONGEST_NAME or not name.isprintable():
            raise NotNow(f"A fruit's name has at most {LONGEST_NAME} letters.")
        living = (seen.id for seen in reading.target if seen.living and seen.id != fruitlet)
        other = next((each for each in living if names.get(each) == name), None)
        if other is not None and not insist:
            there, here = letter_of(other), letter_of(fruitlet)
            raise Doubtful(
                f"{there} is called {name} already. Is it {here} that is, and {there} not?"
            )
        written: list[Row] = [CaliperIdentity(reading.id, fruitlet, name)]
        if diameter_mm is not None:
            size = CaliperSize(self._block, record.tag_id, record.day, name, diameter_mm)
            written.append(size)
        self.view.store.append(*written)
        measured = "" if diameter_mm is None else f", {diameter_mm:.2f} mm by caliper"
        return f"Fruitlet {letter_of(fruitlet)} is called {name}{measured}."

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
