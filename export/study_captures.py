"""Renders and reads the blocks of the growth study; a run that was cut short goes on.

`nice make study`, or `python -m export.study_captures [--part tuning] [--clusters N]
[--views N]`, keeps each capture's readings beside its truth as one file under export/.cache/study.
Pictures are not kept: they follow from the seeds. Clusters are taken in turn over all
sets, so that a run that is stopped early holds the first clusters of every set.
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cv2

from export.study_pictures import photograph
from fieldcam.codec.readings import dump_reading
from fieldcam.models import find_models
from fieldcam.report.scoring import score_capture
from fieldcam.simulator import BlockPlan, TrueFruitlet, Truth, Variety, calibration_of
from fieldcam.values import ClusterReading, Expectation, Matcher, Settings, Status
from fieldcam.vision.pipeline import Pipeline

FOLDER = Path("export/.cache/study")
DAYS = (0, 2, 4)
CLUSTERS, VIEWS = 70, 2
TRIES = 3
"""As often an operator photographs a cluster whose pictures are refused."""
Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class StudySet:
    """One block of the study: a variety in a season."""

    name: str
    seed: int
    variety: Variety

    def block(self) -> BlockPlan:
        return BlockPlan.plan(self.seed, CLUSTERS, self.variety)


STUDY = (
    StudySet("2021 Fuji", 8_200_001, Variety(6.4, 0.53, 1.05)),
    StudySet("2021 Gala", 8_200_002, Variety(7.2, 0.48, 1.08)),
    StudySet("2021 Honeycrisp", 8_200_003, Variety(7.2, 0.27, 1.06)),
    StudySet("2022 Fuji", 8_200_004, Variety(5.3, 0.37, 1.05)),
    StudySet("2022 Gala", 8_200_005, Variety(6.2, 0.28, 1.08)),
    StudySet("2022 Honeycrisp", 8_200_006, Variety(7.0, 0.42, 1.06)),
)
"""First sizes and persisting shares of the paper's six sets (its Tables 2 and 4)."""
TUNING = (
    StudySet("tuning small", 6_200_001, Variety(6.2, 0.4, 1.06)),
    StudySet("tuning large", 6_200_002, Variety(8.5, 0.4, 1.08)),
)
"""For choosing how fruitlets are associated; never part of a published figure."""
PARTS = {"tuning": TUNING, "study": STUDY}


@dataclass(frozen=True, slots=True)
class Job:
    """One picture of one cluster that the operator keeps."""

    of: StudySet
    cluster: int
    day: int
    view: int

    @property
    def path(self) -> Path:
        name = f"{self.cluster:02d}_day{self.day}_{self.view}.json.gz"
        return FOLDER / self.of.name.replace(" ", "_") / name


def jobs(sets: tuple[StudySet, ...], clusters: int, views: int) -> Iterator[Job]:
    """First views of all clusters, then second ones."""
    for view in range(views):
        for cluster in range(clusters):
            for of in sets:
                yield from (Job(of, cluster, day, view) for day in DAYS)


def read(job: Job) -> None:
    """Photograph, read with both matchers, and keep what was read beside the truth."""
    block = job.of.block()
    calibration = calibration_of(block)
    expectation = Expectation(tag_id=block.clusters[job.cluster].tag_id)
    for attempt in range(TRIES):
        pair, truth = photograph(block, job.cluster, job.day, job.view + VIEWS * attempt)
        reading = _pipeline().analyse(pair, calibration, expectation)
        if reading.verdict.status is not Status.RETAKE:
            break
    sgbm = Settings(stereo=Matcher.SGBM)
    other = _pipeline().analyse(pair, calibration, expectation, sgbm)
    document = {
        "attempts": attempt + 1,
        "truth": [_true(fruitlet) for fruitlet in truth.fruitlets],
        "readings": {"raft": _kept(reading, truth), "sgbm": _kept(other, truth)},
    }
    write_document(job.path, document)


def _true(fruitlet: TrueFruitlet) -> Json:
    return {
        "id": fruitlet.id,
        "diameter_mm": fruitlet.diameter_mm,
        "visible_fraction": fruitlet.visible_fraction,
        "center_mm": fruitlet.center_mm,
        "center_px": fruitlet.center_px,
    }


def _kept(reading: ClusterReading, truth: Truth) -> Json:
    """A reading, and which true fruitlet of the target each of its fruitlets is."""
    scored = score_capture(reading, truth).fruitlets
    identities = {
        str(each.reading.id): each.truth.id
        for each in scored
        if each.reading is not None and each.truth is not None and each.truth.in_target
    }
    return {"identities": identities, "reading": json.loads(dump_reading(reading))}


@cache
def _pipeline() -> Pipeline:
    cv2.setNumThreads(1)
    return Pipeline.from_models(find_models())


def write_document(path: Path, document: Json) -> None:
    """Whole or not at all, so that a run can be cut at any moment."""
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_suffix(f".{os.getpid()}")
    half.write_bytes(gzip.compress(json.dumps(document).encode(), 5))
    half.rename(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--part", choices=PARTS, default="study")
    parser.add_argument("--clusters", type=int, default=CLUSTERS)
    parser.add_argument("--views", type=int, default=VIEWS)
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    wanted = jobs(PARTS[arguments.part], arguments.clusters, arguments.views)
    missing = [job for job in wanted if not job.path.exists()]
    with ProcessPoolExecutor(arguments.processes) as pool:
        for done, _ in enumerate(pool.map(read, missing), start=1):
            print(f"\r{done} of {len(missing)}", end="", flush=True)
    print()


if __name__ == "__main__":
    main()
