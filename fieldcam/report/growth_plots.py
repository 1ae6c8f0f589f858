"""How a block's forecast went from visit to visit, and which fruitlets grow how fast."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import TYPE_CHECKING

import numpy as np

from fieldcam.growth.crop import CropPlan, crop_forecast
from fieldcam.growth.forecast import Forecast, FruitletState
from fieldcam.growth.resampling import Interval
from fieldcam.growth.visits import visits_of
from fieldcam.report.page import Html
from fieldcam.report.plotting import BAD, CAMERA, GOOD, INK, QUIET, drawn
from fieldcam.values import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE_IN = (5.4, 2.8)
MIN_TICK_SHARE = 0.1
"""Of a date axis, between two labels."""
_BARS = {
    "stays": ((FruitletState.PERSIST,), GOOD, ""),
    "will fall": ((FruitletState.ABSCISE,), BAD, "///"),
    "not counted": ((FruitletState.NEW, FruitletState.IGNORED), QUIET, "..."),
}
"""By the words of the legend: states, colour, and a pattern for grey prints."""
_FEWEST_BINS, _MAX_BINS = 8, 40


def trend_plot(
    trend: Sequence[Forecast], sprays: Sequence[date] = (), plan: CropPlan | None = None
) -> Html:
    """A forecast at each visit after the first: fruit per tree with a plan, else the set.

    Bars are 90 % intervals of all trees like the tagged ones, none where one cluster is all
    that is known; `trend` is not empty.
    """

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        values, intervals = _steps(trend, plan)
        days = [step.end.first for step in trend]
        low = [value - interval[0] for value, interval in zip(values, intervals, strict=True)]
        high = [interval[1] - value for value, interval in zip(values, intervals, strict=True)]
        places = _places(days)
        axes.errorbar(
            places, values, yerr=np.clip([low, high], 0, None), fmt="o-", color=CAMERA, capsize=4
        )
        for place, value in zip(places, values, strict=True):
            axes.annotate(
                f"{value:.0f}", (place, value), (7, 5), textcoords="offset points", fontsize=9
            )
        axes.set_ylabel("set (% of first fruitlets)" if plan is None else "fruit per tree")
        _mark_sprays(axes, sprays)
        _mark_target(axes, plan)
        first = visits_of(trend[0].block)[0].first
        _date_axis(axes, first, days)
        axes.set_ylim(bottom=0)

    return drawn(SIZE_IN, draw, "The forecast at each visit")


def rate_histogram(found: Forecast) -> Html:
    """Growth rates by what they mean, with reference and cutoff."""

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        rates = {name: _rates(found, states) for name, (states, *_) in _BARS.items()}
        cutoff, reference = found.reference.cutoff_mm_per_day, found.reference.rate_mm_per_day
        edges = bin_edges(np.concatenate(list(rates.values())), cutoff)
        below = np.zeros(len(edges) - 1)
        for name, (_, colour, pattern) in _BARS.items():
            counts = np.histogram(rates[name], edges)[0]
            if counts.any():
                axes.bar(
                    edges[:-1], counts, np.diff(edges), below, align="edge", color=colour,
                    hatch=pattern, edgecolor=INK, linewidth=0.4, label=f"{name} ({counts.sum()})",
                )  # fmt: skip
            below += counts
        for at, what, dash in ((cutoff, "cutoff", "--"), (reference, "reference", "-")):
            axes.axvline(at, color=INK, linestyle=dash, linewidth=1.4)
            axes.annotate(
                f"{what} {at:.2f}", (at, 1.0), (0, 3), xycoords=("data", "axes fraction"),
                textcoords="offset points", ha="left" if what == "reference" else "right",
                fontsize=9,
            )  # fmt: skip
        axes.set_xlabel("growth (mm/day)")
        axes.set_ylabel("fruitlets")
        axes.locator_params(axis="y", integer=True)
        figure.legend(loc="outside lower center", ncols=len(_BARS))

    return drawn(SIZE_IN, draw, "Histogram of growth rates")


def _steps(trend: Sequence[Forecast], plan: CropPlan | None) -> tuple[list[float], list[Interval]]:
    if plan is None:
        values = [step.set_pct for step in trend]
        known = [step.interval90_trees_pct for step in trend]
    else:
        crops = [crop_forecast(step, plan) for step in trend]
        values = [crop.fruit for crop in crops]
        known = [crop.interval90_fruit for crop in crops]
    intervals = [each or (value, value) for value, each in zip(values, known, strict=True)]
    return values, intervals


def _mark_sprays(axes: Axes, sprays: Sequence[date]) -> None:
    for place, spray in zip(_places(sprays), sprays, strict=True):
        axes.axvline(place, color=QUIET, linestyle=":", linewidth=1.4)
        axes.annotate(
            f"spray {spray.day} {spray:%b}", (place, 0.03), (3, 0), rotation=90, color=QUIET,
            xycoords=("data", "axes fraction"), textcoords="offset points", fontsize=8.5,
        )  # fmt: skip


def _mark_target(axes: Axes, plan: CropPlan | None) -> None:
    if plan is None or plan.target_fruit is None:
        return
    axes.axhline(plan.target_fruit, color=GOOD, linestyle="--", linewidth=1.6)
    axes.annotate(
        f"target {plan.target_fruit:g}", (1.0, plan.target_fruit), (-3, 3), ha="right",
        xycoords=("axes fraction", "data"), textcoords="offset points", color=GOOD,
    )  # fmt: skip


def _date_axis(axes: Axes, first: date, days: Sequence[date]) -> None:
    """Ticks are the visits, the newest first where they would run into each other."""
    shown = sorted({first, *days})
    room = (shown[-1] - shown[0]).days * MIN_TICK_SHARE
    named: list[date] = []
    for day in reversed(shown):
        if not named or (named[-1] - day).days >= room:
            named.append(day)
    axes.set_xticks(_places(named), [f"{day.day} {day:%b}" for day in named])
    axes.set_xticks(_places(shown), minor=True)
    axes.set_xlim(first.toordinal() - 1, shown[-1].toordinal() + 1)


def _places(days: Sequence[date]) -> list[float]:
    return [float(day.toordinal()) for day in days]


def _rates(found: Forecast, states: Sequence[FruitletState]) -> Floats:
    rates = [e.rate_mm_per_day for e in found.fruitlets if e.state in states]
    return np.array([rate for rate in rates if rate is not None], np.float64)


def bin_edges(rates: Floats, cutoff: float) -> Floats:
    """(M,) of bins for (N,) values that meet at the cutoff: none holds both who stays and falls."""
    low, high = float(rates.min()), float(rates.max())
    span = max(high, cutoff) - min(low, cutoff) or 1.0
    wanted = len(np.histogram_bin_edges(rates, "fd")) - 1
    width = span / int(np.clip(wanted, _FEWEST_BINS, _MAX_BINS))
    below = int(np.ceil((cutoff - min(low, cutoff)) / width))
    above = int(np.ceil((max(high, cutoff) - cutoff) / width)) + 1
    return np.asarray(cutoff + width * np.arange(-below, above + 1))
