"""Two themes of our own: every status colour is at least 7:1 on its background."""

from __future__ import annotations

from textual.theme import Theme

DARK = Theme(
    name="fieldcam-dark",
    dark=True,
    primary="#8cc8ff",
    secondary="#8cc8ff",
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
    secondary="#003a9e",
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
OTHER = {DARK.name: LIGHT.name, LIGHT.name: DARK.name}
"""What the one key switches to."""
