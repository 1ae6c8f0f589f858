"""The keys that take a picture: Space, and those that remotes for cameras and slides send."""

from __future__ import annotations

import os

from textual.binding import Binding

VARIABLE = "FIELDCAM_SHUTTER_KEYS"
"""More of them, by the names that `Learn a remote's key` shows, with commas."""
COMMON = "space,pageup,pagedown,raise_volume,lower_volume"
SHOOT = Binding(
    COMMON, "shoot", "Capture", show=False, priority=True, id="shoot", tooltip="Take the picture"
)


def shutter_keys(*learned: str) -> str:
    """All of them, as a keymap takes them."""
    named = [name.strip() for name in os.environ.get(VARIABLE, "").split(",")]
    return ",".join(dict.fromkeys([*COMMON.split(","), *filter(None, named), *learned]))
