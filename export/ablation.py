"""What each correction of the sizing is worth, from the paper's recipe to the default.

`python -m export.ablation [--folder DIR] [--pairs N] [--networks-once]` runs the
shipped networks on rendered pairs, sizes the same masks and disparities in every
way, and prints a Markdown table. The last rows, which `--networks-once` leaves
out, are other ways through the whole pipeline and run the networks again.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from export.evaluate import VALIDATION, Outcome, figures, read_truth
from fieldcam.calibration.reading.readers import load_rectified
from fieldcam.exchange.images import read_pair
from fieldcam.exchange.reading_report import reading_report
from fieldcam.models import find_models
from fieldcam.values import (
    Calibration,
    DisparityWindow,
    Expectation,
    Instance,
    Matcher,
    Method,
    Settings,
    StereoPair,
)
from fieldcam.vision.clouds import FruitletCloud
from fieldcam.vision.pipeline import Pipeline
from fieldcam.vision.segmentation import is_cut
from fieldcam.vision.sizing.covers import covers
from fieldcam.vision.sizing.diameters import (
    Observation,
    SizedOutline,
    size_by_paper,
    size_fruitlet,
)
from fieldcam.vision.sizing.parameters import Corrections, SizingParameters

Sizing = Callable[[Observation, Calibration], SizedOutline]
Rows = dict[str, list[Outcome]]

NOTHING = Corrections(False, False, False, False, False)
LABELS = {
    "subpixel": "edges to a fraction of a pixel",
    "own_edge": "only its own edges",
    "robust": "robust fit with priors",
    "center_depth": "depth of the centre",
    "perspective": "perspective",
}
"""The corrections in the order in which they are switched on."""
DEFAULT = "all of them: the default"
OTHER_WAYS = {
    "`--stereo sgbm`": Settings(stereo=Matcher.SGBM),
    "`--method paper`": Settings(method=Method.PAPER),
    "`--method paper --stereo sgbm`": Settings(Method.PAPER, Matcher.SGBM),
}


@dataclass(slots=True, eq=False)
class Observed:
    """What the sizes of a pair are made from."""

    instances: Sequence[Instance]
    clouds: Sequence[FruitletCloud]
    window: DisparityWindow
    calibration: Calibration

    def observations(self) -> list[Observation]:
        """One for each instance, as the pipeline puts them together."""
        before = covers(self.instances, self.clouds, self.window, self.calibration)
        return [
            Observation(i, self.window, cloud.known, cover, is_cut(i, self.window.region))
            for i, cloud, cover in zip(self.instances, self.clouds, before, strict=True)
        ]


class ObservedPipeline(Pipeline):
    """The pipeline; keeps what the last pair's sizes were made from."""

    observed: Observed

    def _sizes(
        self,
        instances: Sequence[Instance],
        clouds: Sequence[FruitletCloud],
        window: DisparityWindow,
        calibration: Calibration,
        settings: Settings,
    ) -> list[SizedOutline]:
        self.observed = Observed(instances, clouds, window, calibration)
        return super()._sizes(instances, clouds, window, calibration, settings)

    @property
    def sizing_parameters(self) -> SizingParameters:
        return self._parameters.sizing

    def sizing(self, corrections: Corrections) -> Sizing:
        """The pipeline's own sizing with some of its corrections."""
        parameters = self.sizing_parameters
        return lambda observed, calibration: size_fruitlet(
            observed, calibration, parameters, corrections
        )


def ways(pipeline: ObservedPipeline) -> dict[str, Sizing]:
    """Each way of sizing the same observations, by its label."""
    found: dict[str, Sizing] = {"the paper's formula": size_by_paper}
    corrections = NOTHING
    found["refusing what is hidden or rough"] = pipeline.sizing(corrections)
    for name, label in LABELS.items():
        corrections = replace(corrections, **{name: True})
        found[f"+ {label}"] = pipeline.sizing(corrections)
    found[DEFAULT] = found.pop(f"+ {LABELS['perspective']}")
    for name, label in LABELS.items():
        found[f"the default without: {label}"] = pipeline.sizing(
            replace(Corrections(), **{name: False})
        )
    return found


def measure(folders: Sequence[Path], settings: Mapping[str, Settings]) -> Rows:
    """Outcomes of all pairs for each way of sizing and each way through the pipeline."""
    pipeline = ObservedPipeline.from_models(find_models())
    sizings = ways(pipeline)
    rows: Rows = {label: [] for label in (*sizings, *settings)}
    for number, folder in enumerate(folders, 1):
        sys.stderr.write(f"ablation: {number} of {len(folders)}\n")
        outcome = analyse(pipeline, folder, Settings())
        observed = pipeline.observed
        observations = observed.observations()
        for label, sizing in sizings.items():
            sizes = [sizing(o, observed.calibration) for o in observations]
            rows[label].append(with_sizes(outcome, sizes))
        if rows[DEFAULT][-1].errors_mm.keys() != outcome.errors_mm.keys():
            raise SystemExit(f"{folder}: the table's default is not what the pipeline gives")
        for label, other in settings.items():
            rows[label].append(analyse(pipeline, folder, other))
    return rows


def analyse(pipeline: Pipeline, folder: Path, settings: Settings) -> Outcome:
    """What the pipeline says about a rendered pair's folder."""
    pair = StereoPair(*read_pair(folder / "left.png", folder / "right.png"))
    calibration = load_rectified(folder / "calibration.yml")
    expectation = Expectation(read_truth(folder)["tag"])
    return Outcome.of(
        folder, reading_report(pipeline.analyse(pair, calibration, expectation, settings))
    )


def with_sizes(outcome: Outcome, sizes: Sequence[SizedOutline]) -> Outcome:
    """The same outcome with other sizes of the same fruitlets."""
    fruitlets = [
        reported | {"diameter_mm": size.diameter_mm}
        for reported, size in zip(outcome.report["fruitlets"], sizes, strict=True)
    ]
    return replace(outcome, report=outcome.report | {"fruitlets": fruitlets})


def table(rows: Rows) -> Iterator[str]:
    """Markdown; errors in mm."""
    common = _common(rows)
    yield (
        f"| sizing | sizes | MAE | bias | 95 % within | MAE on the {len(common)} that every row "
        "sizes | sized of those >= 60 % visible | of all |"
    )
    yield "| --- |" + " ---: |" * 7
    for label, outcomes in rows.items():
        f = figures(outcomes)
        shared = [abs(e) for key, e in _errors(outcomes).items() if key in common]
        yield (
            f"| {label} | {f.sizes} | {f.mae_mm:.3f} | {f.bias_mm:+.3f} | {f.p95_mm:.2f} "
            f"| {np.mean(shared):.3f} | {f.sized_share_well_visible:.1%} "
            f"| {f.sized_share_living:.1%} |"
        )


def _common(rows: Rows) -> set[tuple[str, int]]:
    """Pair and true fruitlet of those that every row sizes."""
    return set.intersection(*(set(_errors(outcomes)) for outcomes in rows.values()))


def _errors(outcomes: Sequence[Outcome]) -> dict[tuple[str, int], float]:
    return {(o.name, k): error for o in outcomes for k, error in o.errors_mm.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--folder", type=Path, default=VALIDATION)
    parser.add_argument("--pairs", type=int, help="only the first N")
    parser.add_argument("--networks-once", action="store_true", help="leave out the last rows")
    options = parser.parse_args()
    folders = [p.parent for p in sorted(options.folder.glob("*/truth.json"))][: options.pairs]
    if not folders:
        raise SystemExit(f"There are no rendered pairs in {options.folder}.")
    rows = measure(folders, {} if options.networks_once else OTHER_WAYS)
    sys.stdout.write(f"{len(folders)} rendered pairs of {options.folder}; errors in mm.\n\n")
    sys.stdout.write("\n".join(table(rows)) + "\n")


if __name__ == "__main__":
    main()
