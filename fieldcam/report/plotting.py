"""Plots as SVG for the inside of a page: they take its text colour and fit its width.

Drawn without pyplot and without a clock, so that equal data give equal bytes.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from fieldcam.errors import ExtraMissing
from fieldcam.report.page import Html, escaped

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.typing import RcKeyType

CAMERA, CALIPERS = "#2f7ed8", "#e07b00"
"""Told apart on white, on black and by the colour-blind; shapes differ for grey prints."""
GOOD, BAD, QUIET = "#2e9e5b", "#c8503c", "#888888"
INK = "#123456"
"""Stands for the page's own text colour, which follows light, dark and print."""
INCH_PX = 72
READABLE, LARGEST = 0.6, 1.4
"""Scales to which plots shrink on the screen of a phone, and grow on a wide one."""
_STYLE: dict[RcKeyType, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "fieldcam",
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": QUIET,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
}
_NO_METADATA = dict.fromkeys(("Creator", "Date", "Format", "Type"))


def drawn(size_in: tuple[float, float], draw: Callable[[Figure], None], says: str) -> Html:
    """The SVG of what `draw` puts on a figure; `says` is for those who cannot see it.

    Raises ExtraMissing where matplotlib is not installed.
    """
    with _styled():
        from matplotlib.figure import Figure

        figure = Figure(figsize=size_in, layout="constrained")
        figure.patch.set_alpha(0.0)
        draw(figure)
        for axes in figure.axes:
            axes.patch.set_alpha(0.0)
        written = io.StringIO()
        figure.savefig(written, format="svg", metadata=_NO_METADATA)
    return _for_a_page(written.getvalue(), size_in, says)


def empty(axes: Axes, text: str) -> None:
    """Say why there is nothing to draw."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, color=QUIET)


@contextmanager
def _styled() -> Iterator[None]:
    try:
        from matplotlib import rc_context
    except ModuleNotFoundError as error:
        raise ExtraMissing(
            f"Reports with plots need the module {error.name}.",
            "Install it with: pip install 'fieldcam[report]'",
        ) from error
    with rc_context(_STYLE):
        yield


def _for_a_page(svg: str, size_in: tuple[float, float], says: str) -> Html:
    """Without the file's head and the groups' names, which several plots would share."""
    body = svg[svg.index("<defs>") :] if "<defs>" in svg else svg[svg.index("<g") :]
    body = re.sub(r'<g id="[^"]*"', "<g", body).replace(INK, "currentColor")
    width, height = (round(INCH_PX * side, 2) for side in size_in)
    return Html(
        f'<svg role="img" aria-label="{escaped(says)}" viewBox="0 0 {width} {height}"'
        f' style="width: {LARGEST * width:.0f}pt; min-width: {READABLE * width:.0f}pt" xmlns:xlink="http://www.w3.org/1999/xlink">\n{body}'
    )
