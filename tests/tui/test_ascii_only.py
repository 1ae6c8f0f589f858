"""Terminals whose locale has no UTF-8 still show everything, and their keys end nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len
from terminals import Terminal
from test_ended_by_signals import walk_in

from fieldcam.tui.looks import Look, PictureStyle, chosen_look
from fieldcam.tui.text.ascii_only import has_utf8, in_ascii

UMLAUT_IN_LATIN_1 = "\udcfc"


@pytest.mark.parametrize(
    ("environ", "expected"),
    [
        ({}, True),
        ({"LANG": "de_DE.UTF-8"}, True),
        ({"LANG": "C.utf8"}, True),
        ({"LANG": "C"}, False),
        ({"LANG": "POSIX"}, False),
        ({"LANG": "de_DE.ISO-8859-1"}, False),
        ({"LANG": "de_DE@euro"}, False),
        ({"LANG": "C", "LC_CTYPE": "C.UTF-8"}, False),
        ({"LC_CTYPE": "C.UTF-8"}, True),
        ({"LANG": "C", "LC_CTYPE": "en_US.UTF-8"}, True),
        ({"LANG": "en_US.UTF-8", "LC_ALL": "C"}, False),
        ({"LANG": "C", "LC_ALL": "en_US.UTF-8"}, True),
    ],
)
def test_what_the_locale_says(environ: dict[str, str], expected: bool) -> None:
    assert has_utf8(environ) is expected
    look = chosen_look({"TERM": "xterm", **environ}, lambda: PictureStyle.BLOCKS)
    assert look == Look(PictureStyle.BLOCKS if expected else PictureStyle.CELLS)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("██  ▀", "##  #"),
        ("Taking tag 8 … ←→", "Taking tag 8 . <>"),
        ("Müller ±0.1 å", "Muller ?0.1 a"),
        ("───▼", "---v"),
        ("\x1b[1;31mRETAKE\x1b[0m", "\x1b[1;31mRETAKE\x1b[0m"),
    ],
)
def test_the_nearest_ascii(text: str, expected: str) -> None:
    assert in_ascii(text) == expected


@given(st.text())
def test_fuzz_any_text_becomes_ascii_of_its_width(text: str) -> None:
    found = in_ascii(text)
    assert found.isascii()
    if text.isprintable():
        assert cell_len(found) == sum(map(cell_len, text))


def test_the_app_in_a_locale_without_utf8(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "C")
    with Terminal(lambda: walk_in(tmp_path)) as terminal:
        terminal.wait_for("aim, press Space")
        assert "##########" in terminal.seen and terminal.seen.isascii()
        terminal.press(UMLAUT_IN_LATIN_1)
        terminal.press("l")
        terminal.wait_for("Log")
        terminal.press("\x11")
        assert terminal.ended() == 0
