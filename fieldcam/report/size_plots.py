"""Sizes by camera beside those by calipers, as the paper shows them, and more honestly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
from typing import TYPE_CHECKING

import numpy as np

from fieldcam.growth.agreement import agreement
from fieldcam.growth.evaluation.sizing import SizePair, compared, line_r2
from fieldcam.report.page import Html
from fieldcam.report.plotting import CALIPERS, CAMERA, QUIET, drawn, empty
from fieldcam.values import Floats
from fieldcam.words import signed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Sets = Mapping[str, Sequence[SizePair]]
"""Pairs of sizes by the name of what they are of: a block, or a set of a study."""
PAGE_IN = 5.4
"""Width of a plot over the whole page."""
MIN_REACH_MM = 0.5
"""Differences are shown from so much below to so much above their middle, or more."""
MAX_PANELS = 3
"""Beside each other."""
_LINES = {"camera": (CAMERA, "-"), "calipers": (CALIPERS, "--")}
"""Colour and dash."""
_MARKS = ("o", "^", "s", "D", "v", "P", "X")


def size_boxes(sets: Sets) -> Html:
    """Box plots of all sizes by day; means as crosses, medians as bars."""

    def draw(figure: Figure) -> None:
        for axes, (name, pairs) in zip(_panels(figure, len(sets)), sets.items(), strict=True):
            _boxes(axes, pairs)
            axes.set_title(name)
            axes.set_ylabel("diameter (mm)")
        _name_colours(figure)

    return drawn(_panels_in(len(sets)), draw, "Box plots of sizes by day")


def size_cdfs(sets: Sets) -> Html:
    """Cumulative distributions by day."""

    def draw(figure: Figure) -> None:
        for axes, (name, pairs) in zip(_panels(figure, len(sets)), sets.items(), strict=True):
            _cdfs(axes, pairs)
            axes.set_title(name)
            axes.set_xlabel("diameter (mm)")
            axes.set_ylabel("share of fruitlets")
        _name_colours(figure)

    return drawn(_panels_in(len(sets)), draw, "Cumulative distributions of sizes by day")


def line_fits(pairs: Sequence[SizePair]) -> Html:
    """A panel for each day: camera over calipers, line and identity."""
    days = _days(pairs)

    def draw(figure: Figure) -> None:
        for axes, day in zip(_panels(figure, len(days)), days, strict=True):
            _fit(axes, [p for p in pairs if p.day == day])
            axes.set_title(_day(day))

    rows = -(-len(days) // MAX_PANELS) or 1
    return drawn((PAGE_IN, 2.5 * rows), draw, "Camera over calipers by day")


def bland_altman(pairs: Sequence[SizePair]) -> Html:
    """Differences over means, with bias and 95 % limits of agreement."""

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        found = agreement(*(sizes.tolist() for sizes in compared(pairs)))
        if found is None:
            empty(axes, "nothing was measured both ways")
            return
        for mark, day in zip(_cycle(len(_days(pairs))), _days(pairs), strict=True):
            camera, calipers = compared([p for p in pairs if p.day == day])
            axes.plot(
                (camera + calipers) / 2, camera - calipers, mark, ms=3.5, alpha=0.6, label=_day(day)
            )
        axes.axhline(found.bias_mm, color=QUIET, linewidth=1.2)
        title = f"bias {signed(found.bias_mm)} mm"
        if found.limits_mm is not None:
            low, high = found.limits_mm
            title += f", 95 % from {signed(low)} mm to {signed(high)} mm"
            for at in found.limits_mm:
                axes.axhline(at, color=QUIET, linestyle="--", linewidth=1.2)
        middle, reach = np.mean(axes.get_ylim()), np.ptp(axes.get_ylim()) / 2
        axes.set_ylim(*(middle + max(float(reach), MIN_REACH_MM) * np.array([-1, 1])))
        axes.set_title(title, loc="right")
        axes.set_xlabel("mean of camera and calipers (mm)")
        axes.set_ylabel("camera less calipers (mm)")
        figure.legend(loc="outside lower center", ncols=len(_MARKS))

    return drawn((PAGE_IN, 3.2), draw, "Differences of camera and calipers over their mean")


def _panels(figure: Figure, count: int) -> list[Axes]:
    columns = min(count, MAX_PANELS) or 1
    grid = figure.subplots(-(-count // columns) or 1, columns, squeeze=False)
    panels = list(grid.flat)
    for axes in panels[count:]:
        axes.set_axis_off()
    return panels[:count]


def _name_colours(figure: Figure) -> None:
    """One legend for all panels."""
    axes = figure.axes[0]
    shown = [
        axes.plot([], [], color=colour, linestyle=dash, label=name)[0]
        for name, (colour, dash) in _LINES.items()
    ]
    figure.legend(handles=shown, loc="outside lower center", ncols=len(shown))


def _panels_in(count: int) -> tuple[float, float]:
    rows = -(-count // MAX_PANELS) or 1
    return (4.8, 3.4) if count <= 1 else (PAGE_IN, 0.3 + 2.7 * rows)


def _boxes(axes: Axes, pairs: Sequence[SizePair]) -> None:
    days = _days(pairs)
    if not days:
        empty(axes, "no sizes")
        return
    for shift, (name, (colour, dash)) in zip((-0.2, 0.2), _LINES.items(), strict=True):
        sizes = [_sizes(pairs, name, day) for day in days]
        lines = {"color": colour, "linewidth": 1.3}
        axes.boxplot(
            sizes,
            positions=[k + shift for k in range(len(days))],
            widths=0.32,
            showmeans=True,
            meanprops={"marker": "x", "markeredgecolor": colour, "markersize": 5},
            medianprops=lines | {"linewidth": 2},
            boxprops=lines | {"linestyle": dash},
            whiskerprops=lines,
            capprops=lines,
            flierprops={"marker": ".", "markersize": 3, "markeredgecolor": colour},
            manage_ticks=False,
        )
    axes.set_xticks(range(len(days)), [_day(day) for day in days])
    axes.set_xlim(-0.6, len(days) - 0.4)


def _cdfs(axes: Axes, pairs: Sequence[SizePair]) -> None:
    days = _days(pairs)
    if not days:
        empty(axes, "no sizes")
        return
    for k, day in enumerate(days):
        strength = 0.35 + 0.65 * (k + 1) / len(days)
        for name, (colour, dash) in _LINES.items():
            sizes = np.sort(_sizes(pairs, name, day))
            if len(sizes):
                rising = np.arange(1, len(sizes) + 1) / len(sizes)
                axes.step(
                    sizes, rising, dash, where="post", color=colour, alpha=strength, linewidth=1.3
                )
    axes.set_ylim(0, 1.02)


def _fit(axes: Axes, pairs: Sequence[SizePair]) -> None:
    camera, calipers = compared(pairs)
    if not len(camera):
        empty(axes, "nothing was\nmeasured both ways")
        return
    low = float(min(camera.min(), calipers.min())) - 0.5
    high = float(max(camera.max(), calipers.max())) + 0.5
    axes.plot([low, high], [low, high], ":", color=QUIET, linewidth=1.2)
    axes.plot(calipers, camera, ".", color=CAMERA, alpha=0.5, ms=4)
    r2 = line_r2(calipers, camera)
    if r2 is not None:
        slope, offset = np.polyfit(calipers, camera, 1)
        ends = np.array([calipers.min(), calipers.max()])
        axes.plot(ends, slope * ends + offset, color=CALIPERS, linewidth=1.5)
    axes.set_xlim(low, high)
    axes.set_ylim(low, high)
    axes.set_aspect("equal")
    axes.set_xlabel("calipers (mm)")
    axes.set_ylabel("camera (mm)")
    fit = "" if r2 is None else f"\nR² {r2:.3f}"
    bias = float((camera - calipers).mean())
    axes.text(
        0.04, 0.96, f"n {len(camera)}{fit}\nbias {signed(bias)} mm", transform=axes.transAxes,
        va="top", fontsize=8,
    )  # fmt: skip


def _sizes(pairs: Sequence[SizePair], by: str, day: date) -> Floats:
    sizes = [
        p.camera_mm if by == "camera" else p.calipers_mm
        for p in pairs
        if p.day == day and not (by == "camera" and p.outlier)
    ]
    return np.array([mm for mm in sizes if mm is not None], np.float64)


def _days(pairs: Sequence[SizePair]) -> list[date]:
    return sorted({pair.day for pair in pairs})


def _cycle(count: int) -> list[str]:
    return [_MARKS[k % len(_MARKS)] for k in range(count)]


def _day(day: date) -> str:
    return f"{day.day} {day:%b}"
