"""Four quality lights: a word each, never colour alone."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Horizontal

from fieldcam.session.state import Shown
from fieldcam.tui.text.telling import LIGHTS, lights
from fieldcam.tui.widgets.words import Words

WORDS = {True: "good", False: "BAD", None: "-"}


class LightsView(Horizontal):
    """Shows tag, sharpness, light and depth of the picture."""

    def compose(self) -> ComposeResult:
        for name in LIGHTS:
            yield Words(f"{name} -", id=f"light-{name}")

    def show(self, shown: Shown | None) -> None:
        for light in lights(shown):
            lamp = self.query_one(f"#light-{light.name}", Words)
            lamp.update(f"{light.name} {WORDS[light.good]}")
            lamp.set_class(light.good is True, "-good")
            lamp.set_class(light.good is False, "-bad")
