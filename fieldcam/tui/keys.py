"""What the keys of a screen do, by their plain names: for the help page and the palette.

The plain name of a binding is its tooltip; its description is the word in the footer.
"""

from __future__ import annotations

from dataclasses import dataclass

from textual.dom import DOMNode
from textual.screen import Screen

_NAMES = {
    "space": "Space",
    "enter": "Enter",
    "escape": "Esc",
    "pageup": "PgUp",
    "pagedown": "PgDn",
    "question_mark": "?",
}


@dataclass(frozen=True, slots=True)
class KeyCommand:
    """One command of a screen, or of the whole app."""

    key: str
    """The first of those that do the same, as it is called on a keyboard."""
    name: str
    action: str
    node: DOMNode
    """Where the action belongs to."""


def key_commands(screen: Screen[object]) -> tuple[KeyCommand, ...]:
    """Those with a plain name, in the order of the screen, then of the app."""
    found: dict[tuple[str, str], KeyCommand] = {}
    for active in screen.active_bindings.values():
        binding = active.binding
        if not binding.tooltip:
            continue
        about = binding.tooltip, binding.action
        if about not in found:
            key = binding.key_display or key_name(binding.key)
            found[about] = KeyCommand(key, binding.tooltip, binding.action, active.node)
    return tuple(found.values())


def key_name(key: str) -> str:
    """Of letters that every font has."""
    if key.startswith("ctrl+"):
        return f"Ctrl+{key[-1].upper()}"
    return _NAMES.get(key, key.upper() if len(key) == 1 else key)
