"""Themes of our own, by day and by night: every status colour is at least 7:1.

Green is good, yellow asks, red is bad or struck out, blue is what is in hand: chosen,
being taken or read, just said. White and grey mean nothing.

The Linux console has 16 colours, so it has a pair of its own: its red falls short,
and on its grey nothing but black is dark enough.
"""

from __future__ import annotations

from textual.theme import Theme

DARK = Theme(
    name="fieldcam-dark",
    dark=True,
    primary="#8cc8ff",
    secondary="#b8b8b8",
    accent="#8cc8ff",
    success="#7cff9b",
    warning="#ffd75f",
    error="#ff9b9b",
    foreground="#ffffff",
    background="#000000",
    surface="#000000",
    panel="#262626",
    variables={"footer-key-foreground": "#8cc8ff", "footer-background": "#262626"},
)
LIGHT = Theme(
    name="fieldcam-light",
    dark=False,
    primary="#003a9e",
    secondary="#484848",
    accent="#003a9e",
    success="#005a1e",
    warning="#7a3b00",
    error="#a00000",
    foreground="#000000",
    background="#ffffff",
    surface="#ffffff",
    panel="#e6e6e6",
    variables={"footer-key-foreground": "#003a9e", "footer-background": "#e6e6e6"},
)
CONSOLE = Theme(
    name="fieldcam-console",
    dark=True,
    primary="#55ffff",
    secondary="#aaaaaa",
    accent="#55ffff",
    success="#55ff55",
    warning="#ffff55",
    error="#ff55ff",
    foreground="#ffffff",
    background="#000000",
    surface="#000000",
    panel="#0000aa",
    variables={"footer-key-foreground": "#ffff55", "footer-background": "#0000aa"},
)
CONSOLE_LIGHT = Theme(
    name="fieldcam-console-light",
    dark=False,
    primary="#000000",
    secondary="#000000",
    accent="#000000",
    success="#000000",
    warning="#000000",
    error="#000000",
    foreground="#000000",
    background="#aaaaaa",
    surface="#aaaaaa",
    panel="#ffffff",
    variables={"footer-key-foreground": "#0000aa", "footer-background": "#ffffff"},
)
ALL = (DARK, LIGHT, CONSOLE, CONSOLE_LIGHT)
OTHER = {
    DARK.name: LIGHT.name,
    LIGHT.name: DARK.name,
    CONSOLE.name: CONSOLE_LIGHT.name,
    CONSOLE_LIGHT.name: CONSOLE.name,
}
"""What the one key switches to."""
