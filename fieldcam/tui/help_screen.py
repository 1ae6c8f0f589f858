"""All keys on one page."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.events import Key
from textual.widgets import Static

from fieldcam.tui.dialog import Dialog

KEYS = """\
Space   take the picture         Enter   accept it
R       take it again            S       add a second view
F       > is fallen              H       > is hidden by a leaf
T       say which tag it is      C       another cluster is the target
X       strike a false fruitlet  N       write a note
K       skip this cluster        U       undo the last decision
left, right   another tag        up, down   another fruitlet
W       on to the next tree      E       set-up: block, route, sprays
A       aim; Space or a remote's key fires there too, G by itself
O       route: go to any cluster V       this cluster on all days
B       block: sizes, missing    I       device (R: again), camera, disk
L       log                      D       day or night colours
Ctrl+P  all commands             Q       end the walk; Ctrl+Q anywhere
On Cluster: left, right pictures; N, P tags; C > by caliper; T two days;
K > king; M one by hand; PgUp, PgDn words; G growth, on Block too.

Walk on once a picture is saved; it is read meanwhile. CONFIRM asks why
there are fewer fruitlets than last visit: F or H answers it.

Any key closes this page."""


class HelpScreen(Dialog[None]):
    """Shown over any other screen."""

    CSS_PATH = "help_screen.tcss"

    def compose(self) -> ComposeResult:
        with Vertical(id="keys"):
            yield Static(KEYS, markup=False)

    def on_key(self, event: Key) -> None:
        event.stop()
        self.dismiss()

    def on_click(self) -> None:
        self.dismiss()
