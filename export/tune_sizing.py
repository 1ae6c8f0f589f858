"""What the thresholds of sizing separate, on pairs that are for tuning only.

`python -m export.tune_sizing [--folder DIR]` renders the tuning orchard where it
is missing, runs the shipped networks once on each pair, and prints the figures
for other values of one setting at a time. `edge_bias_px` stands in the networks'
manifest, the rest in `fieldcam.vision.sizing.parameters`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fieldcam.vision.sizing.diameters import size_fruitlet
from fieldcam.vision.sizing.parameters import SizingParameters

from export.ablation import Observed, ObservedPipeline, analyse, with_sizes
from export.evaluate import Outcome, figures
from export.render_orchard import TUNING, render_tuning
from fieldcam.models import find_models
from fieldcam.values import Settings

GRID: Mapping[str, Sequence[float]] = {
    "edge_bias_px": (-0.2, -0.1, 0.0, 0.1, 0.2, 0.3),
    "min_score": (0.7, 0.8, 0.9, 0.95),
    "max_sd_mm": (0.2, 0.25, 0.3, 0.35, 0.45),
    "max_sd_share": (0.025, 0.035, 0.05),
    "min_coverage": (0.2, 0.3, 0.4, 0.5),
    "min_visible_fraction": (0.2, 0.35, 0.5, 0.6),
    "max_residual_px": (0.6, 0.8, 1.0, 1.3),
    "max_residual_share": (0.02, 0.03, 0.04),
    "max_depth_spread_mm": (3.0, 4.0, 6.0, 9.0),
}


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """One pair: what the pipeline says, and what its sizes were made from."""

    outcome: Outcome
    observed: Observed

    def sized(self, parameters: SizingParameters) -> Outcome:
        """The same pair with other thresholds."""
        camera = self.observed.calibration
        sizes = [size_fruitlet(o, camera, parameters) for o in self.observed.observations()]
        return with_sizes(self.outcome, sizes)


def see(pipeline: ObservedPipeline, folders: Sequence[Path]) -> Iterator[Seen]:
    for number, folder in enumerate(folders, 1):
        sys.stderr.write(f"tuning: {number} of {len(folders)}\n")
        yield Seen(analyse(pipeline, folder, Settings()), pipeline.observed)


def table(seen: Sequence[Seen], now: SizingParameters) -> Iterator[str]:
    """Markdown; the first row is what is shipped."""
    yield "| setting | sizes | MAE | bias | 95 % within | sized of those >= 60 % visible |"
    yield "| --- |" + " ---: |" * 5
    yield _row("as shipped", seen, now)
    for name, values in GRID.items():
        for value in values:
            if value != getattr(now, name):
                changed: dict[str, Any] = {name: value}
                yield _row(f"{name} {value:g}", seen, replace(now, **changed))


def _row(label: str, seen: Sequence[Seen], parameters: SizingParameters) -> str:
    f = figures([each.sized(parameters) for each in seen])
    return (
        f"| {label} | {f.sizes} | {f.mae_mm:.3f} | {f.bias_mm:+.3f} | {f.p95_mm:.2f} "
        f"| {f.sized_share_well_visible:.1%} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--folder", type=Path, default=TUNING)
    arguments = parser.parse_args()
    if arguments.folder == TUNING:
        render_tuning()
    folders = sorted(p.parent for p in arguments.folder.glob("*/truth.json"))
    pipeline = ObservedPipeline.from_models(find_models())
    seen = list(see(pipeline, folders))
    sys.stdout.write("\n".join(table(seen, pipeline.sizing_parameters)) + "\n")


if __name__ == "__main__":
    main()
