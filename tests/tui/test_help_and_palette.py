"""Every command has a plain name: on the help page of its screen, and in the palette."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_states import AIM
from screens import SMALL, Driven, drive

from fieldcam.session.commands import Accept, SkipCluster, UndoLast
from fieldcam.tui.looks import Look, in_theme
from fieldcam.tui.remembered import remember_theme, remembered_theme
from fieldcam.tui.screens.page import LEAST
from fieldcam.tui.themes import CONSOLE, DARK, LIGHT

OPENED = {
    "Walk": ("R      Retake", "Enter  Accept the picture", "Q      Quit"),
    "Aim": ("G      Automatic", "K      Skip", "Esc    Back to the walk"),
    "Route": ("Esc    Back to the walk", "U      Undo the last decision"),
    "Cluster": ("K      King", "C      Caliper size", "T      Two days"),
    "Two days": ("1-9    The chosen (>) is this one", "F      Fallen", "H      Hidden"),
    "Block": ("G      Growth",),
    "Growth": ("PgDn   Later words",),
    "Device": ("R      Restart the analysis",),
    "Log": ("Esc    Back",),
}
KEYS = {
    "Walk": (),
    "Aim": ("a",),
    "Route": ("o",),
    "Cluster": ("v",),
    "Two days": ("v", "t"),
    "Block": ("b",),
    "Growth": ("b", "g"),
    "Device": ("i",),
    "Log": ("l",),
}


@pytest.mark.parametrize("title", OPENED)
def test_help_explains_the_screen_that_it_is_pressed_on(title: str) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press(*KEYS[title], "question_mark")
        lines = driven.text.splitlines()
        assert any(line.strip().startswith(f"{title}:") for line in lines)
        for told in OPENED[title]:
            assert told in driven.text
        assert "Any key closes this page." in driven.text
        assert ("S      Second view" in driven.text) is (title == "Walk")
        assert len(lines) <= LEAST[1]

    drive(SMALL, script)


PLAIN = (
    "Accept the picture",
    "Undo the last decision",
    "Skip this cluster today",
    "Quit",
    "Theme: day or night",
    "Retake: take it again",
    "Note on the picture",
    "Two days",
)


def test_the_palette_has_every_command_of_the_screen() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        screen = driven.app.screen
        commands = {each.title: each for each in driven.app.get_system_commands(screen)}
        assert set(PLAIN) <= set(commands)
        own = {binding.tooltip for binding in vars(type(screen))["BINDINGS"] if binding.tooltip}
        assert {name for name in own if name not in ("Aim through the camera",)} <= set(commands)
        for name in PLAIN[:3]:
            commands[name].callback()
            await driven.settle()

    assert drive(SMALL, script).walk.asked == [Accept(), UndoLast(), SkipCluster()]


def test_a_command_is_found_by_its_name() -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("ctrl+p", *"accept")
        await driven.pilot.pause(0.5)
        await driven.press("enter")
        await driven.settle()

    assert drive(SMALL, script).walk.asked == [Accept()]


@pytest.mark.parametrize(
    ("keys", "ended"),
    [(("q",), False), (("q", "x"), False), (("q", "y"), True), (("ctrl+q",), True)],
)
def test_quitting_is_not_one_key_beside_another(keys: tuple[str, ...], ended: bool) -> None:
    exits: list[bool] = []

    async def script(driven: Driven) -> None:
        driven.app.exit = lambda *args, **kwargs: exits.append(True)  # type: ignore[method-assign]
        await driven.tell(AIM)
        await driven.press(*keys)
        assert ("End the walk?" in driven.text) is (keys[-1] in ("q", "x"))

    drive(SMALL, script)
    assert bool(exits) is ended


def test_the_chosen_theme_is_remembered(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert remembered_theme() is None
    remember_theme(LIGHT.name)
    assert in_theme(Look(), remembered_theme()).theme == LIGHT.name
    remember_theme(DARK.name)
    assert in_theme(Look(), remembered_theme()).theme == DARK.name
    assert in_theme(Look(theme=CONSOLE.name), LIGHT.name).theme == CONSOLE.name
    (tmp_path / "fieldcam/theme").write_bytes(b"\xff")
    assert remembered_theme() is None


def test_the_app_says_which_theme_was_chosen() -> None:
    chosen: list[str] = []

    async def script(driven: Driven) -> None:
        driven.app._remember = chosen.append
        await driven.tell(AIM)
        await driven.press("d", "d")

    drive(SMALL, script)
    assert chosen == [LIGHT.name, DARK.name]
