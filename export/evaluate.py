"""Measures `fieldcam size` on rendered pairs that nothing was trained or tuned on.

`python -m export.evaluate [--folder DIR] [-- --method paper]` renders the
validation orchard where it is missing, runs the command on each pair and prints
the figures that belong together; what follows `--` is passed on to it.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from export.render_orchard import season, write
from fieldcam.cli.main import main as fieldcam
from fieldcam.report.scoring import WELL_VISIBLE

VALIDATION = Path("export/.cache/validation")
VALIDATION_SEED, BLOCKS, CLUSTERS = 7_000_001, 7, 9
SAME_BOX_IOU = 0.3
Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Figures:
    """What is said about a set of pairs, always together."""

    pairs: int
    sizes: int
    mae_mm: float
    bias_mm: float
    p95_mm: float
    above_1_mm_share: float
    within_1_sd_share: float
    """Of the sizes with a standard deviation; 0.68 if it is true."""
    within_95_share: float
    """Within 1.96 standard deviations."""
    sized_share_well_visible: float
    sized_share_living: float
    foreign_share: float
    target_right_share: float
    retake_share: float
    median_seconds: float


@dataclass(frozen=True, slots=True)
class Outcome:
    """One pair's report beside its truth."""

    name: str
    truth: Json
    report: Json
    partners: tuple[int | None, ...]
    """For each reading in the target: the true fruitlet's index."""

    @classmethod
    def of(cls, folder: Path, report: Json) -> Outcome:
        """What `fieldcam size --json` says about a rendered pair's folder, beside its truth."""
        truth = read_truth(folder)
        return cls(folder.name, truth, report, _partners(report, truth))

    @property
    def errors_mm(self) -> dict[int, float]:
        """By the true fruitlet's index."""
        return {
            k: f["diameter_mm"] - self.truth["fruitlets"][k]["diameter_mm"]
            for f, k in zip(self.target, self.partners, strict=True)
            if f["diameter_mm"] is not None and k is not None
        }

    @property
    def errors_in_sds(self) -> list[float]:
        """Absolute errors in stated standard deviations, where one is stated."""
        errors = self.errors_mm
        return [
            abs(errors[k]) / f["sd_mm"]
            for f, k in zip(self.target, self.partners, strict=True)
            if k in errors and f.get("sd_mm")
        ]

    @property
    def target(self) -> list[Json]:
        return [f for f in self.report["fruitlets"] if f["in_target"]]

    @property
    def foreign(self) -> int:
        return sum(k is None or not self.truth["fruitlets"][k]["in_target"] for k in self.partners)

    @property
    def target_right(self) -> bool:
        """The target holds a fruitlet of the cluster and no foreign one."""
        return bool(self.target) and self.foreign == 0


def measure(folder: Path, extra: Sequence[str]) -> list[Outcome]:
    """Run `fieldcam size` on every capture of a folder."""
    return [_outcome(p.parent, extra) for p in sorted(folder.glob("*/truth.json"))]


def figures(outcomes: Sequence[Outcome]) -> Figures:
    """Sum up; every size given out counts, whatever its fruitlet's visibility."""
    errors = np.array([e for o in outcomes for e in o.errors_mm.values()])
    in_sds = np.array([e for o in outcomes for e in o.errors_in_sds] or [np.nan])
    living = [
        (f["visible_fraction"] >= WELL_VISIBLE, k in o.errors_mm)
        for o in outcomes
        for k, f in enumerate(o.truth["fruitlets"])
        if f["in_target"]
    ]
    well = [sized for visible, sized in living if visible]
    readings = sum(len(o.target) for o in outcomes)
    return Figures(
        pairs=len(outcomes),
        sizes=len(errors),
        mae_mm=round(float(np.abs(errors).mean()), 4),
        bias_mm=round(float(errors.mean()), 4),
        p95_mm=round(float(np.quantile(np.abs(errors), 0.95)), 4),
        above_1_mm_share=round(float((np.abs(errors) > 1).mean()), 4),
        within_1_sd_share=round(float((in_sds < 1).mean()), 4),
        within_95_share=round(float((in_sds < 1.96).mean()), 4),
        sized_share_well_visible=round(sum(well) / max(len(well), 1), 4),
        sized_share_living=round(sum(s for _, s in living) / max(len(living), 1), 4),
        foreign_share=round(sum(o.foreign for o in outcomes) / max(readings, 1), 4),
        target_right_share=round(sum(o.target_right for o in outcomes) / len(outcomes), 4),
        retake_share=round(
            sum(o.report["verdict"]["status"] == "retake" for o in outcomes) / len(outcomes), 4
        ),
        median_seconds=round(
            float(np.median([o.report["timing_ms"]["total"] for o in outcomes])) / 1000, 3
        ),
    )


def read_truth(folder: Path) -> Json:
    """What `render_orchard` wrote about a pair."""
    truth: Json = json.loads((folder / "truth.json").read_text())
    return truth


def _outcome(folder: Path, extra: Sequence[str]) -> Outcome:
    truth = read_truth(folder)
    argv = ["size", str(folder / "left.png"), str(folder / "right.png"), "--json"]
    argv += ["--calibration", str(folder / "calibration.yml"), "--tag", str(truth["tag"]), *extra]
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):
        status = fieldcam(argv)
    if status != 0:
        raise SystemExit(f"fieldcam size failed with {status} on {folder}")
    return Outcome.of(folder, json.loads(printed.getvalue()))


def _partners(report: Json, truth: Json) -> tuple[int | None, ...]:
    """Best overlaps first, no true fruitlet twice."""
    target = [f for f in report["fruitlets"] if f["in_target"]]
    overlaps = sorted(
        (
            (_box_iou(f["box_px"], t["box_px"]), i, k)
            for i, f in enumerate(target)
            for k, t in enumerate(truth["fruitlets"])
            if t["visible_px"]
        ),
        reverse=True,
    )
    found: dict[int, int] = {}
    for iou, i, k in overlaps:
        if iou >= SAME_BOX_IOU and i not in found and k not in found.values():
            found[i] = k
    return tuple(found.get(i) for i in range(len(target)))


def _box_iou(a: Sequence[float], b: Sequence[float]) -> float:
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0.0
    areas = [(c[2] - c[0]) * (c[3] - c[1]) for c in (a, b)]
    return float(width * height / (sum(areas) - width * height))


def main() -> None:
    own, _, passed_on = " ".join(sys.argv[1:]).partition(" -- ")
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--folder", type=Path, default=VALIDATION)
    parser.add_argument("--each", action="store_true", help="also print a line for each pair")
    arguments = parser.parse_args(own.split())
    if arguments.folder == VALIDATION:
        for order in season(VALIDATION_SEED, BLOCKS, CLUSTERS):
            write(order, VALIDATION / order.name)
    outcomes = measure(arguments.folder, passed_on.split())
    if arguments.each:
        for o in outcomes:
            status = o.report["verdict"]["status"]
            codes = [r["code"] for r in o.report["verdict"]["reasons"]]
            rounded = [round(e, 2) for e in o.errors_mm.values()]
            sys.stderr.write(f"{o.name} {status} {codes} foreign={o.foreign} {rounded}\n")
    counted = Counter(r["code"] for o in outcomes for r in o.report["verdict"]["reasons"])
    sys.stdout.write(json.dumps(asdict(figures(outcomes)) | {"reasons": counted}, indent=1) + "\n")


if __name__ == "__main__":
    main()
