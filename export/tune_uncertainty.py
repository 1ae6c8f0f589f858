"""Fits the standard deviation of sizes to true errors, on pairs that are for tuning only.

`python -m export.tune_uncertainty [--folder DIR ...]` sizes every target fruitlet of the
pairs, whatever its doubts, fits `fieldcam.vision.sizing.parameters.Uncertainty` by maximum
likelihood, and prints it with how often intervals hold the truth and what each limit on
the standard deviation would give out.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from fieldcam.vision.sizing.diameters import size_fruitlet
from fieldcam.vision.sizing.parameters import SizingParameters, Uncertainty
from scipy.optimize import minimize

from export.ablation import ObservedPipeline, analyse
from export.render_orchard import TUNING, render_tuning
from fieldcam.models import find_models
from fieldcam.values import Settings

Floats = npt.NDArray[np.float64]
LIMITS_MM = (0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.2)
FAR_OFF_SD = 3.0
"""Errors beyond so many standard deviations speak with the weight of these."""
OUTLINE_ALONE = Uncertainty(1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """True errors of sizes (N,), and what sizing knew about each."""

    error_mm: Floats
    diameter_mm: Floats
    outline_sd_mm: Floats
    width_sd: Floats
    """As a share of the width; 0 where the network does not say."""
    seen: Floats
    """Visible fraction that was stated, beside the true one."""
    visible: Floats

    def sds(self, uncertainty: Uncertainty) -> Floats:
        """(N,) standard deviations in mm."""
        given = zip(self.diameter_mm, self.outline_sd_mm, self.width_sd, strict=True)
        return np.array([uncertainty.sd_mm(float(d), float(o), float(w)) for d, o, w in given])


def without_limits(parameters: SizingParameters) -> SizingParameters:
    """Sizes for all that has an outline and a depth; the outline's own sd comes out alone."""
    return replace(
        parameters, uncertainty=OUTLINE_ALONE, max_sd_mm=np.inf, max_sd_share=np.inf,
        min_coverage=0.0, min_visible_fraction=0.0,
    )  # fmt: skip


def gather(pipeline: ObservedPipeline, folders: Sequence[Path]) -> Errors:
    """Errors of all target fruitlets of the pairs."""
    rows: list[tuple[float, ...]] = []
    parameters = without_limits(pipeline.sizing_parameters)
    for number, folder in enumerate(folders, 1):
        sys.stderr.write(f"tuning: {number} of {len(folders)}\n")
        rows += _errors_of(pipeline, folder, parameters)
    return Errors(*np.array(rows).T)


def _errors_of(
    pipeline: ObservedPipeline, folder: Path, parameters: SizingParameters
) -> Iterator[tuple[float, ...]]:
    outcome = analyse(pipeline, folder, Settings())
    observed = pipeline.observed
    sizes = [size_fruitlet(o, observed.calibration, parameters) for o in observed.observations()]
    for reading, partner in zip(outcome.target, outcome.partners, strict=True):
        size, instance = sizes[reading["id"]], observed.instances[reading["id"]]
        if partner is None or size.diameter_mm is None or size.sd_mm is None:
            continue
        truth = outcome.truth["fruitlets"][partner]
        yield (
            size.diameter_mm - truth["diameter_mm"], size.diameter_mm, size.sd_mm,
            instance.width_sd or 0.0, size.visible_fraction, truth["visible_fraction"],
        )  # fmt: skip


def fitted(errors: Errors) -> Uncertainty:
    """The likeliest parts, with the far off errors held back."""

    def unlikely(logs: Floats) -> float:
        sds = errors.sds(Uncertainty(*np.exp(logs)))
        off = np.minimum(np.abs(errors.error_mm) / sds, FAR_OFF_SD)
        return float(np.mean(np.log(sds) + off**2 / 2))

    start = np.log([2.0, 0.5, 0.08, 0.003])
    found = minimize(unlikely, start, method="Nelder-Mead", options={"maxiter": 2000})
    return Uncertainty(*(round(float(v), 4) for v in np.exp(found.x)))


def lines(errors: Errors, found: Uncertainty) -> Iterator[str]:
    """What a reader wants to know of the fit."""
    sds, off = errors.sds(found), np.abs(errors.error_mm)
    yield json.dumps(asdict(found))
    yield f"{len(off)} sizes, median |error| / sd {np.median(off / sds):.2f} (0.67 if true)"
    yield f"within 1 sd {np.mean(off < sds):.1%} (68 %), 1.96 sd {np.mean(off < 1.96 * sds):.1%}"
    gap = np.abs(errors.seen - errors.visible)
    yield f"visible fraction off by {gap.mean():.3f}, 95 % within {np.quantile(gap, 0.95):.3f}"
    yield "| sd at most, mm | sizes | MAE | bias | 95 % within | above 1 mm | within 1 sd | 1.96 |"
    yield "| ---: |" + " ---: |" * 7
    for limit in LIMITS_MM:
        kept = sds <= limit
        if kept.any():
            mm, sd = off[kept], sds[kept]
            yield (
                f"| {limit} | {kept.sum()} | {mm.mean():.3f} | {errors.error_mm[kept].mean():+.3f} "
                f"| {np.quantile(mm, 0.95):.2f} | {np.mean(mm > 1):.1%} "
                f"| {np.mean(mm < sd):.1%} | {np.mean(mm < 1.96 * sd):.1%} |"
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--folder", type=Path, nargs="+", default=[TUNING])
    arguments = parser.parse_args()
    if arguments.folder == [TUNING]:
        render_tuning()
    folders = sorted(p.parent for each in arguments.folder for p in each.glob("*/truth.json"))
    errors = gather(ObservedPipeline.from_models(find_models()), folders)
    sys.stdout.write("\n".join(lines(errors, fitted(errors))) + "\n")


if __name__ == "__main__":
    main()
