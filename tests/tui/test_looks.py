"""What the app looks like on terminals that can do less, or more."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

import cv2
import numpy as np
import pytest
from live_walks import read
from made_states import AIM, shown_with, verdict
from screens import LARGE, SMALL, Driven, check_golden, drive
from stored_walks import MadeWalk, small_store
from textual.widget import Widget

from fieldcam.errors import ExtraMissing
from fieldcam.session.state import WalkState
from fieldcam.session.viewing import WalkView
from fieldcam.tui import looks
from fieldcam.tui.looks import Look, PictureStyle, ask_terminal, chosen_look
from fieldcam.tui.themes import CONSOLE
from fieldcam.tui.widgets.cell_picture import HALF
from fieldcam.tui.widgets.picture_view import PictureView
from fieldcam.values import ImageU8, PixelFormat, Status

WIDE = (160, 45)
COLOURLESS = Look(PictureStyle.NONE, colour=False)
ON_CONSOLE = Look(PictureStyle.CELLS, CONSOLE.name)
CONSOLE_GLYPHS = set(map(chr, range(0x20, 0x7F))) | set("█─│┌┐└┘←↑→↓±µ°\n")
"""What Debian's console fonts have of what a screen could want."""


@pytest.mark.parametrize(
    ("environ", "expected"),
    [
        ({"TERM": "xterm-256color"}, Look(PictureStyle.SIXEL)),
        ({"TERM": "xterm-256color", "FIELDCAM_PICTURES": "blocks"}, Look(PictureStyle.BLOCKS)),
        ({"TERM": "xterm-256color", "FIELDCAM_PICTURES": "none"}, Look(PictureStyle.NONE)),
        ({"TERM": "xterm-256color", "FIELDCAM_PICTURES": "odd"}, Look(PictureStyle.SIXEL)),
        ({"TERM": "linux"}, ON_CONSOLE),
        ({"TERM": "linux", "FIELDCAM_PICTURES": "sixel"}, ON_CONSOLE),
        ({"TERM": "linux", "FIELDCAM_PICTURES": "none"}, Look(PictureStyle.NONE, CONSOLE.name)),
        ({"TERM": "xterm", "NO_COLOR": ""}, COLOURLESS),
        ({"TERM": "linux", "NO_COLOR": "1"}, COLOURLESS),
        ({"TERM": "dumb"}, COLOURLESS),
        ({"TERM": "vt100", "FIELDCAM_PICTURES": "kitty"}, COLOURLESS),
    ],
)
def test_the_look_follows_the_terminal(
    environ: dict[str, str], expected: Look, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[str] = []
    monkeypatch.setattr(looks, "find_spec", lambda name: object())
    monkeypatch.setattr(looks, "import_module", loaded.append)
    assert chosen_look(environ, lambda: PictureStyle.SIXEL) == expected
    assert loaded == ["textual_image.widget"] * (expected.pictures is PictureStyle.SIXEL)


def test_what_is_asked_for_must_be_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(looks, "find_spec", lambda name: None)
    with pytest.raises(ExtraMissing, match="pictures"):
        chosen_look({"TERM": "xterm", "FIELDCAM_PICTURES": "sixel"})


def test_only_a_terminal_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(looks, "find_spec", lambda name: object())
    # Would raise ImportError, or write to the terminal.
    monkeypatch.setitem(sys.modules, "textual_image", None)
    monkeypatch.setattr("sys.stdin.isatty", lambda: False)
    assert ask_terminal() is PictureStyle.BLOCKS


def test_the_terminal_says_what_it_can(monkeypatch: pytest.MonkeyPatch) -> None:
    library, renderable = ModuleType("textual_image"), ModuleType("textual_image.renderable")
    vars(renderable).update(TGPImage="tgp", SixelImage="sixel", Image="tgp")
    vars(library).update(renderable=renderable)
    monkeypatch.setitem(sys.modules, "textual_image", library)
    monkeypatch.setattr(looks, "find_spec", lambda name: object())
    for stream in ("stdin", "stdout"):
        monkeypatch.setattr(f"sys.{stream}.isatty", lambda: True)
    found = {}
    for known in ("tgp", "sixel", "halfcell"):
        vars(renderable).update(Image=known)
        found[known] = ask_terminal()
    expected = (PictureStyle.KITTY, PictureStyle.SIXEL, PictureStyle.BLOCKS)
    assert tuple(found.values()) == expected


def test_without_colours_there_are_only_words_and_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_COLOR", "1")

    async def script(driven: Driven) -> None:
        await driven.tell(verdict(tmp_path, Status.ACCEPT))
        check_golden("walk-colourless-80x24", driven.text)
        strips = driven.app.screen._compositor.render_strips()
        styles = [segment.style for strip in strips for segment in strip]
        assert not any(s.color and s.color.is_default is False for s in styles if s is not None)
        await driven.press("a")
        assert driven.text.startswith(" SIMULATED  Aim") and "▀" not in driven.text

    drive(SMALL, script, COLOURLESS)


@pytest.fixture
def console_walk(tmp_path: Path) -> Iterator[MadeWalk]:
    with small_store(tmp_path) as store:
        yield MadeWalk(store)


def test_the_console_is_asked_for_no_glyph_that_it_lacks(
    console_walk: MadeWalk, tmp_path: Path
) -> None:
    visit = console_walk.visit()
    for tag_id in (11, 12):
        console_walk.accept(visit, tag_id)
    stored = WalkView(console_walk.store, visit).state()
    shown = shown_with(tmp_path, read(12))

    async def script(driven: Driven) -> None:
        await driven.tell(replace(stored, tag_id=12, shown=shown))
        texts = {"walk": driven.text}
        for key in (
            "v",
            "t",
            "b",
            "i",
            "o",
            "l",
            "escape",
            "a",
            "question_mark",
            "escape",
            "ctrl+p",
        ):
            await driven.press(key)
            texts[key] = driven.text
        for name, text in texts.items():
            assert set(text) <= CONSOLE_GLYPHS, (name, set(text) - CONSOLE_GLYPHS)
        assert driven.app.theme == CONSOLE.name

    drive(SMALL, script, ON_CONSOLE)


def test_a_wide_window_shows_the_days_beside_the_sizes(console_walk: MadeWalk) -> None:
    console_walk.accept(console_walk.visit(), 11, 3)
    state = WalkView(console_walk.store, console_walk.visit(2)).state()

    async def script(driven: Driven) -> None:
        await driven.tell(state)
        assert "21 May  3: 10.00 mm" in driven.text
        await driven.pilot.resize_terminal(120, 40)
        await driven.settle()
        assert "10.00 mm" not in driven.text
        await driven.tell(replace(state, tag_id=12))
        await driven.pilot.resize_terminal(*WIDE)
        await driven.settle()
        assert "10.00 mm" not in driven.text
        await driven.tell(replace(state, tag_id=11))
        assert "10.00 mm" in driven.text
        await driven.tell(replace(state, tag_id=None))
        assert "10.00 mm" not in driven.text

    drive(WIDE, script)


def spoiled(state: WalkState, spoil: Callable[[Path], object]) -> WalkState:
    assert state.shown is not None
    spoil(state.shown.left)
    return state


@pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])
def test_a_picture_that_is_not_there_says_so_in_its_place(
    tmp_path: Path, size: tuple[int, int]
) -> None:
    async def script(driven: Driven) -> None:
        state = verdict(tmp_path, Status.ACCEPT)
        await driven.tell(spoiled(state, Path.unlink))
        assert HALF not in driven.text
        assert "The file of this picture is" in driven.text and "missing." in driven.text
        assert "backup" in driven.text
        assert " 9.00 mm" in driven.text
        await driven.tell(AIM)
        assert "missing" not in driven.text
        state = verdict(tmp_path, Status.ACCEPT)
        await driven.tell(spoiled(state, lambda left: left.write_bytes(b"P5\n9 9\n255\n")))
        assert "damaged." in driven.text and HALF not in driven.text

    drive(size, script)


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_a_picture_that_was_imported_is_drawn(tmp_path: Path, suffix: str) -> None:
    state = verdict(tmp_path, Status.ACCEPT)
    assert state.shown is not None
    left = tmp_path / f"left{suffix}"
    cv2.imwrite(str(left), np.full((480, 640, 3), (20, 20, 200), np.uint8))
    state = replace(state, shown=replace(state.shown, left=left, pixel_format=PixelFormat.RGB8))

    async def script(driven: Driven) -> None:
        await driven.tell(state)
        assert HALF in driven.text
        red = {
            segment.style.color.triplet[0]
            for segment in driven.app.screen.query_one(PictureView).render_line(3)
            if segment.style and segment.style.color and segment.style.color.triplet
        }
        assert max(red) > 190
        cut = left.with_stem("cut")
        cut.write_bytes(left.read_bytes()[:100])
        assert state.shown is not None
        await driven.tell(replace(state, shown=replace(state.shown, left=cut)))
        assert "damaged." in driven.text

    drive(SMALL, script)


class ToldImage(Widget):
    """In place of the library's widget."""

    image: ImageU8 | None = None


def test_pixels_are_left_to_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library, pillow = ModuleType("textual_image.widget"), ModuleType("PIL")
    vars(library).update(SixelImage=ToldImage, TGPImage=ToldImage)
    vars(pillow).update(Image=SimpleNamespace(fromarray=lambda array: array))
    for module in (ModuleType("textual_image"), library, pillow):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.delitem(sys.modules, "fieldcam.tui.widgets.pixel_picture", raising=False)

    async def script(driven: Driven) -> None:
        await driven.tell(verdict(tmp_path, Status.ACCEPT))
        image = driven.app.screen.query_one(ToldImage).image
        cells = driven.app.screen.query_one(PictureView).size
        assert image is not None and image.any()
        assert image.shape == (cells.height * 16, cells.width * 8, 3)
        await driven.tell(AIM)
        assert driven.app.screen.query_one(ToldImage).image is None
        await driven.tell(spoiled(verdict(tmp_path, Status.ACCEPT), Path.unlink))
        assert "missing." in driven.text

    drive(SMALL, script, Look(PictureStyle.SIXEL))
