"""The target's diameters as a list with bars; one of them is chosen."""

from __future__ import annotations

from collections.abc import Mapping

from rich.text import Text

from fieldcam.store.queries.history import FruitletSeen, ReadingSummary
from fieldcam.store.rows.judgements import MarkKind
from fieldcam.tui.text.letters import BLOCK
from fieldcam.tui.widgets.words import Words
from fieldcam.words import give_or_take

LONGEST_MM = 25.0
"""Of a full bar."""
BAR_COLOURS = ("foreground", "secondary")
"""In turn, since full blocks touch; neither means anything."""
CHOSEN_COLOUR = "primary"
THIN = "="
WORDED = {MarkKind.KING: "king", MarkKind.HIDDEN: "hidden"}
BAR_LEAST, MARGIN = 6, 3


class SizesView(Words):
    """Shows the fruitlets of the target cluster."""

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id, markup=False)
        self._heading = ""
        self._reading: ReadingSummary | None = None
        self._names: Mapping[int, str] = {}
        self._row = 0

    @property
    def chosen(self) -> int | None:
        """The id of the chosen fruitlet."""
        target = self._target
        return target[min(self._row, len(target) - 1)].id if target else None

    def show(
        self, heading: str, reading: ReadingSummary | None, names: Mapping[int, str] | None = None
    ) -> None:
        """`names` are what fruitlets are called, by their ids."""
        self._heading, self._reading, self._names = heading, reading, names or {}
        self._write()

    def choose(self, by: int) -> None:
        """Move the choice up or down."""
        if self._target:
            self._row = (min(self._row, len(self._target) - 1) + by) % len(self._target)
            self._write()

    def pick(self, fruitlet: int) -> None:
        """Choose the fruitlet of this id."""
        ids = [seen.id for seen in self._target]
        if fruitlet in ids:
            self._row = ids.index(fruitlet)
            self._write()

    def on_resize(self) -> None:
        self._write()

    @property
    def _target(self) -> tuple[FruitletSeen, ...]:
        return () if self._reading is None else self._reading.target

    def _write(self) -> None:
        if self._reading is None or not (self._target or self._reading.by_hand_mm):
            self.update("")
            return
        lines = [Text(self._heading, "bold")]
        for row, seen in enumerate(self._target):
            colour = CHOSEN_COLOUR if seen.id == self.chosen else BAR_COLOURS[row % 2]
            lines.append(self._line(seen, self.app.theme_variables[colour]))
        lines += [Text(f"   +  {_size(size_mm)}  by hand") for size_mm in self._reading.by_hand_mm]
        self.update(Text("\n").join(lines))

    def _line(self, seen: FruitletSeen, colour: str) -> Text:
        text = self._told(seen)
        if not _is_sized(seen):
            return Text(text, "" if seen.living else "strike")
        room = max(len(self._told(each)) for each in self._target if _is_sized(each))
        longest = self.size.width - MARGIN - room
        if seen.diameter_mm is None or longest < BAR_LEAST:
            return Text(text)
        # Full blocks of neighbouring rows touch; without colours they would be one.
        glyph = THIN if self.app.no_color else BLOCK
        bar = glyph * max(1, round(min(1.0, seen.diameter_mm / LONGEST_MM) * longest))
        return Text(text.ljust(room + 1)).append(bar, colour)

    def _told(self, seen: FruitletSeen) -> str:
        """All but its bar."""
        mark = ">" if seen.id == self.chosen else " "
        letter = "" if self._reading is None else self._reading.letter(seen.id)
        if not seen.living:
            what = "fallen" if MarkKind.FALLEN in seen.marks else "struck out"
        else:
            what = _size(seen.diameter_mm, seen.sd_mm) + self._worded(seen)
        return f"{mark}{letter:>3}  {what}"

    def _worded(self, seen: FruitletSeen) -> str:
        """Its marks and its name, beside its size."""
        words = [word for kind, word in WORDED.items() if kind in seen.marks]
        named = [self._names[seen.id]] if seen.id in self._names else []
        return "".join(f" {word}" for word in [*words, *named])


def _is_sized(seen: FruitletSeen) -> bool:
    return seen.living and seen.diameter_mm is not None


def _size(diameter_mm: float | None, sd_mm: float | None = None) -> str:
    if diameter_mm is None:
        return "seen, no size"
    return f"{diameter_mm:5.2f} mm{give_or_take(sd_mm)}"
