"""How the app looks on this terminal: its colours, and how pictures are shown.

`FIELDCAM_PICTURES` says `kitty`, `sixel`, `blocks`, `cells` or `none`; without it the
terminal is asked where the extra `pictures` is installed, else half blocks are taken.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from importlib import import_module
from importlib.util import find_spec

from fieldcam.errors import ExtraMissing
from fieldcam.tui.text.ascii_only import has_utf8
from fieldcam.tui.themes import CONSOLE, DARK, OTHER

VARIABLE = "FIELDCAM_PICTURES"
LIBRARY = "textual_image"


class PictureStyle(StrEnum):
    """What a picture is made of."""

    KITTY = "kitty"
    """Pixels, by kitty's protocol."""
    SIXEL = "sixel"
    """Pixels, as xterm, foot, WezTerm and others take them."""
    BLOCKS = "blocks"
    """Two pixels a cell."""
    CELLS = "cells"
    """One pixel a cell, which needs no glyph."""
    NONE = "none"
    """Numbers only."""


PIXELS = (PictureStyle.KITTY, PictureStyle.SIXEL)
"""What the extra `pictures` draws."""


@dataclass(frozen=True, slots=True)
class Look:
    """What fits one terminal."""

    pictures: PictureStyle = PictureStyle.BLOCKS
    theme: str = DARK.name
    colour: bool = True


def ask_terminal() -> PictureStyle:
    """What the terminal can draw; only before the app starts, as it reads the answer."""
    at_a_terminal = all(stream.isatty() for stream in (sys.stdin, sys.stdout))
    if not at_a_terminal or find_spec(LIBRARY) is None:
        return PictureStyle.BLOCKS
    from textual_image import renderable

    known = {renderable.TGPImage: PictureStyle.KITTY, renderable.SixelImage: PictureStyle.SIXEL}
    return known.get(renderable.Image, PictureStyle.BLOCKS)


def chosen_look(environ: Mapping[str, str], ask: Callable[[], PictureStyle] = ask_terminal) -> Look:
    """What the environment says; `ask` is called where it leaves the choice."""
    terminal = environ.get("TERM", "")
    if "NO_COLOR" in environ or terminal in ("dumb", "unknown") or terminal.startswith("vt"):
        return Look(PictureStyle.NONE, colour=False)
    named = environ.get(VARIABLE, "")
    if terminal == "linux":
        return Look(
            PictureStyle.NONE if named == PictureStyle.NONE else PictureStyle.CELLS, CONSOLE.name
        )
    pictures = PictureStyle(named) if named in tuple(PictureStyle) else ask()
    if pictures is PictureStyle.BLOCKS and not has_utf8(environ):
        pictures = PictureStyle.CELLS
    if pictures in PIXELS:
        _load()
    return Look(pictures)


def in_theme(look: Look, theme: str | None) -> Look:
    """In the theme that was chosen last, where this terminal has it."""
    return replace(look, theme=theme) if theme == OTHER[look.theme] else look


def _load() -> None:
    """The library asks the terminal for the size of its cells, which no running app can."""
    if find_spec(LIBRARY) is None:
        raise ExtraMissing(
            "Pictures in pixels need the extra `pictures`.",
            f"Install it with: pip install 'fieldcam[pictures]', or unset {VARIABLE}.",
        )
    import_module(f"{LIBRARY}.widget")
