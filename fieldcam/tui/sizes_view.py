"""The target's diameters as a list with bars; one of them is chosen."""

from __future__ import annotations

from rich.text import Text
from textual.widgets import Static

from fieldcam.session.state import WalkState
from fieldcam.store.history import FruitletSeen
from fieldcam.tui.letters import BLOCK

LONGEST_MM = 25.0
"""Of a full bar."""
BAR_COLOURS = ("primary", "foreground")
"""In turn, since full blocks touch."""
BAR_LEAST, WORDS = 6, 17


class SizesView(Static):
    """Shows the fruitlets of the target cluster."""

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id, markup=False)
        self._state: WalkState | None = None
        self._row = 0

    @property
    def chosen(self) -> int | None:
        """The id of the chosen fruitlet."""
        target = self._target
        return target[min(self._row, len(target) - 1)].id if target else None

    def show(self, state: WalkState) -> None:
        self._state = state
        self._write()

    def choose(self, by: int) -> None:
        """Move the choice up or down."""
        if self._target:
            self._row = (min(self._row, len(self._target) - 1) + by) % len(self._target)
            self._write()

    def on_resize(self) -> None:
        self._write()

    @property
    def _target(self) -> tuple[FruitletSeen, ...]:
        if self._state is None or self._state.shown is None:
            return ()
        return self._state.shown.target

    def _write(self) -> None:
        if self._state is None or self._state.shown is None or not self._target:
            self.update("")
            return
        lines = [self._heading(self._state)]
        for row, seen in enumerate(self._target):
            lines.append(self._line(seen, self.app.theme_variables[BAR_COLOURS[row % 2]]))
        self.update(Text("\n").join(lines))

    def _heading(self, state: WalkState) -> Text:
        living = state.shown.living if state.shown else None
        before = "" if state.before is None else f", last visit {state.before}"
        marks = "".join(f", {mark.count} {mark.mark}" for mark in state.marks)
        return Text(f"{living} fruitlets{before}{marks}", "bold")

    def _line(self, seen: FruitletSeen, colour: str) -> Text:
        mark = ">" if seen.id == self.chosen else " "
        if not seen.living:
            return Text(f"{mark}{seen.id:3}  struck out", "strike")
        if seen.diameter_mm is None:
            return Text(f"{mark}{seen.id:3}  seen, no size")
        longest = max(BAR_LEAST, self.size.width - WORDS)
        bar = BLOCK * max(1, round(min(1.0, seen.diameter_mm / LONGEST_MM) * longest))
        return Text(f"{mark}{seen.id:3}  {seen.diameter_mm:5.2f} mm ").append(bar, colour)
