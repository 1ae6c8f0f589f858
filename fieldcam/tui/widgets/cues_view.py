"""What must be right before a picture is taken, a line each."""

from __future__ import annotations

from rich.text import Text

from fieldcam.session.aim.cue import Cue
from fieldcam.tui.text.aim_telling import CueLine, cue_lines
from fieldcam.tui.widgets.lights_view import WORDS
from fieldcam.tui.widgets.words import Words

COLOURS = {True: "success", False: "error", None: "foreground"}


class CuesView(Words):
    """Shows tag, range, stillness and flash of one look."""

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id, markup=False)

    def show(self, cue: Cue | None) -> None:
        self.update(Text("\n").join(map(self._line, cue_lines(cue))))

    def _line(self, line: CueLine) -> Text:
        colour = self.app.theme_variables[COLOURS[line.good]]
        return Text(f"{line.name:6} {line.found:22} ").append(WORDS[line.good], f"bold {colour}")
