"""What the command palette offers besides the keys of the screen that is open."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from textual.app import App, SystemCommand
from textual.screen import Screen

from fieldcam.tui.keys import KeyCommand, key_commands
from fieldcam.tui.trick import Trick

CAMERA = (
    ("Route", "Trees and clusters; go to any", "route"),
    ("Aim", "What the camera sees", "aim"),
    ("Learn a remote's key", "A button of yours takes the picture", "learn_key"),
)
"""Each with what it does and its action; tricks of the camera stand behind these."""
OTHERS = (
    ("Cluster", "Pictures and sizes of all days", "cluster"),
    ("Two days", "Which fruitlet is which on another day", "two_days"),
    ("Block", "Sizes by day, what is missing", "block"),
    ("Growth", "How many fruitlets of the block will stay", "growth"),
    ("Device", "Camera, networks, disk, battery, analysis", "device"),
    ("Set-up", "Operator, block, trees, sprays, route", "set_up"),
    ("Log", "What happened on this walk", "log"),
    ("Help", "The keys of this screen", "help"),
    ("Theme: day or night", "The other colours", "switch_theme"),
    ("Start the analysis again", "After it was given up", "restart_analysis"),
)


def palette_commands(
    app: App[None],
    screen: Screen[object],
    tricks: Sequence[Trick],
    play: Callable[[Trick], None],
) -> Iterator[SystemCommand]:
    """The screen's own first."""
    for command in key_commands(screen):
        if command.node is screen and not command.action.startswith("app."):
            yield SystemCommand(command.name, command.key, partial(_run, app, command))
    yield from _offered(app, CAMERA)
    for trick in tricks:
        yield SystemCommand(trick.name, trick.does, partial(play, trick))
    yield from _offered(app, OTHERS)
    yield SystemCommand("Quit", "End the walk; it resumes here", app.exit)


def _offered(app: App[None], commands: Sequence[tuple[str, str, str]]) -> Iterator[SystemCommand]:
    for name, does, action in commands:
        yield SystemCommand(name, does, getattr(app, f"action_{action}"))


def _run(app: App[None], command: KeyCommand) -> None:
    """Once the palette is gone."""
    app.call_later(app.run_action, command.action, command.node)
