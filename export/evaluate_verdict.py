"""How often the verdict is right on pairs that the simulator spoiled, and on good ones.

`python -m export.evaluate_verdict [--clusters N] [--workers N] [--minutes M]` renders
each cluster once good and once for each fault at each severity into a folder
where they are kept, judges every pair with the expected tag and prints a table in
Markdown. Seeds from 8,000,000 on are for this only: no threshold was set on them.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from export.render_orchard import DAYS, Order, write
from fieldcam.calibration.reading.readers import load_rectified
from fieldcam.exchange.images import read_pair
from fieldcam.models import find_models
from fieldcam.simulator import BlockPlan, Faults, SimulatedCapture, Spoiling
from fieldcam.simulator.capture import (
    FRAMING,
    Sight,
    calibration_of,
    develop,
    draw_shot,
    look,
)
from fieldcam.simulator.scene import CARD_MM, build_scene
from fieldcam.values import (
    ClusterReading,
    Expectation,
    ReasonCode,
    Status,
    StereoPair,
)
from fieldcam.vision.pipeline import Pipeline

CACHE = Path("export/.cache/verdict")
SEED = 8_000_101
FRAMED = "tag_in_view.json"
SAME_CENTER_PX = 15.0
BAD_SIZE_MM = 0.5
"""The 95th percentile that good pairs are held to."""

EXTREMES_FIRST = (1, 5, 3, 2, 4)
"""So that a run that is cut short still spans all severities."""

RIGHT_REASONS = {
    Spoiling.DARK: {ReasonCode.TOO_DARK},
    Spoiling.OVEREXPOSED: {ReasonCode.OVEREXPOSED},
    Spoiling.BLURRED: {ReasonCode.BLURRED},
    Spoiling.DEFOCUSED: {ReasonCode.BLURRED},
    Spoiling.TOO_NEAR: {ReasonCode.TOO_NEAR},
    Spoiling.TOO_FAR: {ReasonCode.TOO_FAR},
    Spoiling.CUT_BY_BORDER: {ReasonCode.CUT_BY_BORDER},
    Spoiling.SWAPPED_EYES: {ReasonCode.SWAPPED_EYES},
    Spoiling.MISPAIRED: {ReasonCode.MISPAIRED},
    Spoiling.DRIFTED: {ReasonCode.CALIBRATION_DRIFT},
    Spoiling.TAG_HIDDEN: {ReasonCode.NO_TAG},
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the verdict said about one pair, and what it should have said."""

    name: str
    fault: Spoiling
    severity: int
    status: Status
    reasons: tuple[ReasonCode, ...]
    right_reasons: tuple[ReasonCode, ...]
    worst_error_mm: float | None
    """Of the sizes given out; None where there is none."""

    @property
    def retake(self) -> bool:
        return self.status is Status.RETAKE

    @property
    def right(self) -> bool:
        """RETAKE, for a reason that is the true one."""
        return self.retake and bool(set(self.reasons) & set(self.right_reasons))


class SpoiledOrder(Order):
    """An order that shares one look at a cluster among all faults that leave it as it is."""

    def render(self) -> SimulatedCapture:
        if self.faults.kind in FRAMING:
            return super().render()
        return develop(_good_look(self.seed, self.clusters, self.index, self.day), self.faults)


@lru_cache(maxsize=1)
def _good_look(seed: int, clusters: int, index: int, day: float) -> Sight:
    return look(BlockPlan.plan(seed, clusters), index, day, 0, Faults())


def orders(clusters: int, good: int) -> Iterator[Order]:
    """Cluster by cluster; `good` of them, spoiled or not, are also taken without a fault."""
    for number in range(max(clusters, good)):
        plain = SpoiledOrder(SEED + number, 1, 0, DAYS[number % len(DAYS)])
        if number < good:
            yield plain
        if number < clusters:
            for severity in EXTREMES_FIRST:
                for fault in RIGHT_REASONS:
                    yield SpoiledOrder(plain.seed, 1, 0, plain.day, Faults(fault, severity))


def examine(order: Order) -> Outcome:
    """Render a pair where it is missing, and judge it."""
    cv2.setNumThreads(1)
    folder = CACHE / order.name
    if not (folder / FRAMED).exists():
        write(order, folder)
        (folder / FRAMED).write_text(json.dumps(tag_in_view(order)))
    framed = json.loads((folder / FRAMED).read_text())
    truth = json.loads((folder / "truth.json").read_text())
    pair = StereoPair(*read_pair(folder / "left.png", folder / "right.png"))
    calibration = load_rectified(folder / "calibration.yml")
    reading = _pipeline().analyse(pair, calibration, Expectation(truth["tag"]))
    return Outcome(
        order.name,
        order.faults.kind,
        order.faults.severity,
        reading.verdict.status,
        tuple(r.code for r in reading.verdict.reasons),
        tuple(sorted(right_reasons(order.faults.kind, framed))),
        _worst_error_mm(reading, truth["fruitlets"]),
    )


def right_reasons(fault: Spoiling, framed: bool) -> set[ReasonCode]:
    """What the verdict may say; a tag that the border cuts is also no tag."""
    right = set(RIGHT_REASONS.get(fault, set()))
    if fault is Spoiling.CUT_BY_BORDER and not framed:
        right.add(ReasonCode.NO_TAG)
    return right


def tag_in_view(order: Order) -> bool:
    """Whether both eyes see the whole card."""
    block = BlockPlan.plan(order.seed, order.clusters)
    plan, calibration = block.clusters[order.index], calibration_of(block)
    scene = build_scene(plan, order.day)
    shot = draw_shot(plan, scene, order.day, 0, calibration, order.faults)
    tag_mm = shot.pose.apply(scene.tag_center_mm)
    half_px = CARD_MM / 2 * calibration.px_per_mm(float(tag_mm[2]))
    column, row = (float(v) for v in calibration.places_px(tag_mm))
    left_gap = column - calibration.disparity_px(float(tag_mm[2]))
    right_gap = calibration.width_px - 1 - column
    return min(left_gap, right_gap, row, calibration.height_px - 1 - row) > half_px


@lru_cache(maxsize=1)
def _pipeline() -> Pipeline:
    return Pipeline.from_models(find_models())


def _worst_error_mm(reading: ClusterReading, truth: Sequence[dict[str, Any]]) -> float | None:
    errors = []
    for fruitlet in reading.target:
        if fruitlet.diameter_mm is None:
            continue
        places = ((f["center_px"], f["diameter_mm"]) for f in truth if f["visible_px"])
        near = ((float(np.hypot(*np.subtract(c, fruitlet.center_px))), d) for c, d in places)
        distance_px, true_mm = min(near, default=(np.inf, np.nan))
        if distance_px < SAME_CENTER_PX:
            errors.append(abs(float(fruitlet.diameter_mm) - true_mm))
    return max(errors, default=None)


def summary(outcomes: Iterable[Outcome]) -> list[dict[str, Any]]:
    """One row for each fault and severity, then one for each fault, good pairs first."""
    groups: dict[tuple[str, str], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        if outcome.fault is not Spoiling.NONE:
            groups[outcome.fault, str(outcome.severity)].append(outcome)
            groups[outcome.fault, "all"].append(outcome)
            groups["every fault", "all"].append(outcome)
        else:
            groups["good", "-"].append(outcome)
    order = ["good", "every fault", *RIGHT_REASONS]
    keys = sorted(groups, key=lambda key: (order.index(key[0]), key[1]))
    return [_row(*key, groups[key]) for key in keys]


def _row(fault: str, severity: str, group: Sequence[Outcome]) -> dict[str, Any]:
    accepted = [o for o in group if o.status is Status.ACCEPT]
    harmful = [o for o in accepted if (o.worst_error_mm or 0.0) > BAD_SIZE_MM]
    return {
        "fault": fault,
        "severity": severity,
        "pairs": len(group),
        "retake": _share(o.retake for o in group),
        "retake_right_reason": _share(o.right for o in group),
        "confirm": _share(o.status is Status.CONFIRM for o in group),
        "accept": _share(o.status is Status.ACCEPT for o in group),
        "accept_with_bad_size": len(harmful),
    }


def _share(values: Iterable[bool]) -> float:
    return round(float(np.mean(list(values))), 4)


def markdown(rows: Sequence[dict[str, Any]]) -> str:
    """The table, by fault and severity."""
    lines = [
        "| fault | severity | pairs | RETAKE | RETAKE, right reason | CONFIRM | ACCEPT "
        "| accepted with a size off by > 0.5 mm |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for row in rows:
        shares = " | ".join(
            f"{row[key]:.0%}" for key in ("retake", "retake_right_reason", "confirm", "accept")
        )
        lines.append(
            f"| {row['fault']} | {row['severity']} | {row['pairs']} | {shares} "
            f"| {row['accept_with_bad_size']} |"
        )
    return "\n".join(lines)


def run(wanted: Sequence[Order], workers: int, minutes: float) -> list[Outcome]:
    """Outcomes of as many orders as fit into the time."""
    deadline = time.monotonic() + 60 * minutes
    done = []
    with get_context("spawn").Pool(workers) as pool:
        for outcome in pool.imap(examine, wanted):
            done.append(outcome)
            if time.monotonic() > deadline:
                pool.terminate()
                break
    return done


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--clusters", type=int, default=4, help="clusters to spoil")
    parser.add_argument("--good", type=int, default=20, help="clusters to take without a fault")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--each", action="store_true", help="also print a line for each pair")
    arguments = parser.parse_args()
    wanted = list(orders(arguments.clusters, arguments.good))
    outcomes = run(wanted, arguments.workers, arguments.minutes)
    rows = summary(outcomes)
    document = {"rows": rows, "pairs": [asdict(o) for o in outcomes]}
    (CACHE / "report.json").write_text(json.dumps(document, indent=1))
    if arguments.each:
        for o in outcomes:
            print(o.name, o.status, *o.reasons, "" if o.right or not o.right_reasons else "WRONG")
    print(markdown(rows))


if __name__ == "__main__":
    main()
