"""One contender of the benchmark: runs in a process of its own, prints one JSON document."""

from __future__ import annotations

import argparse
import json
import resource
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import Any, TypeVar

import cv2
import numpy as np

from fieldcam.calibration.reading.readers import load_rectified
from fieldcam.cli.networks import checked_models
from fieldcam.exchange.images import read_pair
from fieldcam.values import Calibration, Matcher, Method, Settings, StereoPair
from fieldcam.vision.pipeline import Pipeline
from fieldcam.vision.stereo.matching import match_whole
from fieldcam.vision.stereo.sgbm import SgbmMatcher

NO_USER_FOLDER = Path("/nonexistent")
"""Only the shipped networks are timed."""
PUBLISHED_ITERATIONS = 32
DETECTIONS = 20
"""Masks that the stock Mask R-CNN draws; a picture shows about as many fruitlets."""
MAX_DISPARITY = 360
PAD = 32

SETTINGS = {
    "default": Settings(),
    "whole": Settings(whole_image=True),
    "paper-method": Settings(method=Method.PAPER),
    "sgbm-region": Settings(stereo=Matcher.SGBM),
}
Stages = dict[str, float]
T = TypeVar("T")


@dataclass(slots=True)
class Times:
    """Milliseconds of each run; the first one is kept apart."""

    stages: list[Stages] = field(default_factory=list)
    totals: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    """Of all threads; unlike the others, it hardly depends on what else runs."""
    first_ms: float | None = None
    note: str = ""

    def run(self, work: Callable[[], T], split: Callable[[T, float], Stages]) -> T:
        """Run once; `split` says which stages the result's milliseconds went to."""
        start, cpu_start = perf_counter(), process_time()
        result = work()
        total_ms = (perf_counter() - start) * 1000
        self.cpu.append((process_time() - cpu_start) * 1000)
        self.totals.append(total_ms)
        self.stages.append(split(result, total_ms))
        return result

    def as_json(self) -> dict[str, Any]:
        names = self.stages[0]
        return {
            "stages_ms": {name: median(run[name] for run in self.stages) for name in names},
            "median_ms": median(self.totals),
            "worst_ms": max(self.totals),
            "cpu_ms": median(self.cpu),
            "first_ms": self.first_ms,
            "runs": len(self.totals),
            "note": self.note,
            "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        }


def load(folder: Path) -> tuple[StereoPair, Calibration]:
    pair = StereoPair(*read_pair(folder / "left.png", folder / "right.png"))
    return pair, load_rectified(folder / "calibration.yml")


def time_pipeline(folder: Path, settings: Settings, repeats: int) -> Times:
    """`fieldcam size` with some settings."""
    times = Times()
    start = perf_counter()
    pair, calibration = load(folder)
    pipeline = Pipeline.from_models(checked_models(NO_USER_FOLDER))
    reading = pipeline.analyse(pair, calibration, settings=settings)
    times.first_ms = (perf_counter() - start) * 1000
    for _ in range(repeats):
        times.run(
            lambda: pipeline.analyse(pair, calibration, settings=settings),
            lambda reading, _: dict(reading.timing_ms),
        )
    times.note = f" ({len(reading.fruitlets)} fruitlets)"
    return times


def time_sgbm(folder: Path, repeats: int) -> Times:
    """OpenCV's matcher over the whole image, as the authors' baseline."""
    pair, _ = load(folder)
    times = Times()
    for _ in range(repeats):
        times.run(
            lambda: match_whole(pair, SgbmMatcher(), MAX_DISPARITY),
            lambda _, total_ms: {"stereo": total_ms},
        )
    return times


def time_mask_rcnn(folder: Path, repeats: int, threads: int) -> Times:
    """The paper's segmentation, with torchvision's own resizing and mask pasting."""
    import torch
    from torchvision.models.detection import maskrcnn_resnet50_fpn

    torch.set_num_threads(threads)
    torch.manual_seed(0)
    # Random scores pass no threshold, so the best few are let through in any case.
    model = maskrcnn_resnet50_fpn(
        weights=None,
        weights_backbone=None,
        num_classes=2,
        box_score_thresh=0.0,
        box_detections_per_img=DETECTIONS,
    ).eval()
    pair, _ = load(folder)
    image = torch.from_numpy(pair.left.transpose(2, 0, 1).astype(np.float32) / 255)
    times = Times()
    with torch.inference_mode():
        found = len(model([image])[0]["masks"])
        for _ in range(min(repeats, 3)):
            times.run(lambda: model([image]), lambda _, total_ms: {"segmentation": total_ms})
    times.note = f", random weights ({found} masks)"
    return times


def time_raft_stereo(folder: Path, iterations: int, threads: int) -> Times:
    """The paper's stereo network, once; its encoders and its iterations apart."""
    import torch

    from export.raft import OFFICIAL, RaftStereo

    torch.set_num_threads(threads)
    torch.manual_seed(0)
    model = RaftStereo(OFFICIAL).eval()
    pair, _ = load(folder)
    left, right = (torch.from_numpy(_padded(eye)) for eye in (pair.left, pair.right))
    updates: list[float] = []
    model.update_block.register_forward_pre_hook(lambda *_: updates.append(perf_counter()))
    times = Times()
    start = perf_counter()
    with torch.inference_mode():
        times.run(
            lambda: model.predict(left, right, iterations),
            lambda _, total_ms: {"stereo": total_ms},
        )
    encoders = (updates[0] - start) * 1000
    refining = times.totals[0] - encoders
    short = "" if iterations == PUBLISHED_ITERATIONS else f" INSTEAD OF {PUBLISHED_ITERATIONS}"
    times.note = (
        f", random weights, {iterations} iterations{short}, one run "
        f"(encoders {encoders:,.0f}, iterations {refining:,.0f})"
    )
    return times


def _padded(image: np.ndarray[Any, np.dtype[np.uint8]]) -> np.ndarray[Any, np.dtype[np.float32]]:
    """(1, 3, h, w) with border pixels repeated up to what the network needs."""
    height, width = image.shape[:2]
    grown = cv2.copyMakeBorder(image, 0, -height % PAD, 0, -width % PAD, cv2.BORDER_REPLICATE)
    return np.ascontiguousarray(grown.transpose(2, 0, 1)[None], dtype=np.float32)


def run(options: argparse.Namespace) -> Times:
    name, folder = options.name, options.pair
    if name == "raft-stereo":
        return time_raft_stereo(folder, options.iterations, options.threads)
    if name == "mask-rcnn":
        return time_mask_rcnn(folder, options.repeats, options.threads)
    if name == "sgbm-whole":
        return time_sgbm(folder, options.repeats)
    return time_pipeline(folder, SETTINGS[name], options.repeats)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("name", choices=[*SETTINGS, "sgbm-whole", "mask-rcnn", "raft-stereo"])
    parser.add_argument("pair", type=Path)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--iterations", type=int, default=PUBLISHED_ITERATIONS)
    options = parser.parse_args()
    cv2.setNumThreads(options.threads)
    sys.stdout.write(json.dumps(run(options).as_json()))


if __name__ == "__main__":
    main()
