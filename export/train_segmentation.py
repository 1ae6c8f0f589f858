"""Trains Mask R-CNN in the paper's two stages: boxes, then masks.

    python -m export.train_segmentation --rendered export/.cache/orchard \\
        --drawn export/.cache/drawn --real ../shared/real/fruit \\
        --out export/.cache/segmentation --start weights.safetensors

Stage 1 trains the backbone, the proposal network and the box heads. Stage 2
freezes the proposal network and the box heads and trains the mask branch. The
backbone goes on learning gently, with the box losses still on it: frozen heads
then stay right for features that move.

In each stage the rate is held until validation has stopped improving, then
falls to almost nothing. Started again, the command goes on where the last
checkpoint was written.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import Tensor
from torch.optim import AdamW

from export.detection_quality import measure_boxes
from export.mask_rcnn import FruitletMaskRCNN, NetworkShape
from export.norms import fix_norms
from export.real_tiles import list_tiles
from export.segmentation_data import (
    DEFAULT_SHARES,
    Batch,
    CropStream,
    Kind,
    Sources,
    batches,
    list_shards,
)
from export.segmentation_quality import measure
from export.segmentation_state import (
    Progress,
    averaged_copy,
    load_weights,
    save_atomically,
    save_weights,
    update_average,
)
from export.segmentation_window import CropSettings, Window, read_window

WARMUP_STEPS = 100
LAST_RATE_SHARE = 0.01
CLIP_NORM = 5.0
WEIGHT_DECAY = 0.02
RATES = {"fresh": (1.5e-3, 2e-3, 4e-4), "started": (4e-4, 6e-4, 1e-4)}
"""Highest rates of all in stage 1, of the masks and of the backbone in stage 2."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """All that a run depends on."""

    sources: Sources
    out: Path
    validation: Sources
    seed: int = 1
    batch: int = 4
    threads: int = 2
    crop: CropSettings = field(default_factory=CropSettings)
    shape: NetworkShape = field(default_factory=NetworkShape)
    checkpoint_every_s: float = 120.0
    measure_every_s: float = 900.0
    patience: int = 4
    """Validations without a better figure after which the rate begins to fall."""
    held_minutes: tuple[float, float] = (600.0, 600.0)
    """Longest time of each stage at the full rate."""
    cooling_steps: int = 1500
    measured_pictures: int = 60
    max_steps: int | None = None
    bfloat16: bool = False
    start: Path | None = None
    """Weights of an earlier run to begin with, in place of random ones."""
    first_stage: int = 1
    """2 where the weights to begin with have their boxes."""

    @property
    def rates(self) -> tuple[float, float, float]:
        """Weights that know something are moved more gently."""
        return RATES["started" if self.start else "fresh"]

    def about(self) -> dict[str, Any]:
        """Plain values for the log and the manifest; no paths."""
        return {
            "seed": self.seed,
            "batch": self.batch,
            "crop": asdict(self.crop),
            "shares": {str(k): v for k, v in self.sources.shares.items()},
            "started_from": load_weights(self.start)[1] if self.start else None,
            "rates": self.rates,
            "weight_decay": WEIGHT_DECAY,
            "patience": self.patience,
            "measure_every_s": self.measure_every_s,
            "cooling_steps": self.cooling_steps,
            "bfloat16": self.bfloat16,
        }


def rate_share(progress: Progress, cooling_steps: int) -> float:
    """Warm-up, the full rate, then a straight line down."""
    warm = min(1.0, (progress.step_in_stage + 1) / WARMUP_STEPS)
    if progress.cooling_from_step is None:
        return warm
    fallen = (progress.step_in_stage - progress.cooling_from_step) / cooling_steps
    return max(LAST_RATE_SHARE, 1.0 - fallen)


def build_optimizer(
    model: FruitletMaskRCNN, stage: int, rates: tuple[float, float, float]
) -> AdamW:
    """Parameter groups of a stage with their highest rate; freezes what it must."""
    model.requires_grad_(True)
    boxes, masks, backbone = rates
    if stage == 1:
        model.masks.requires_grad_(False)
        learnt = [*model.backbone.parameters(), *model.rpn.parameters()]
        groups = [{"params": [*learnt, *model.box_heads.parameters()], "top": boxes}]
    else:
        model.freeze_box_heads()
        groups = [
            {"params": list(model.masks.parameters()), "top": masks},
            {"params": list(model.backbone.parameters()), "top": backbone},
        ]
    return AdamW(groups, lr=boxes, weight_decay=WEIGHT_DECAY)


def as_floats(batch: Batch) -> tuple[Tensor, list[dict[str, Tensor]]]:
    """Images as float and masks as shares."""
    images, targets = batch
    pixels = images.float().contiguous(memory_format=torch.channels_last)
    return pixels, [{**t, "masks": t["masks"].float() / 255.0} for t in targets]


Item = TypeVar("Item")


def _evenly(items: list[Item], count: int) -> list[Item]:
    """At most `count` of them, spread over all."""
    return items[:: max(1, -(-len(items) // count))]


class Run:
    """A training run: its state, one step, and what is written along the way."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self.progress = Progress()
        torch.manual_seed(recipe.seed)
        fresh = load_weights(recipe.start)[0] if recipe.start else FruitletMaskRCNN(recipe.shape)
        self.model = fresh.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.average = averaged_copy(self.model)
        self.optimizer = build_optimizer(self.model, 1, recipe.rates)
        self.checkpoint = recipe.out / "last.pt"
        self.stopped = False
        self.finished = False
        recipe.out.mkdir(parents=True, exist_ok=True)
        if recipe.first_stage == 2:
            self.start_masks()
        if self.checkpoint.exists():
            self.load()

    def save(self) -> None:
        """The whole state, atomically; a full disk is told, and training goes on."""
        content = {
            "progress": asdict(self.progress),
            "model": self.model.state_dict(),
            "average": self.average.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "random": torch.get_rng_state(),
        }
        try:
            save_atomically(content, self.checkpoint)
        except (OSError, RuntimeError) as problem:
            sys.stderr.write(f"The checkpoint could not be written: {problem}\n")

    def load(self) -> None:
        """Takes up the state of the last checkpoint."""
        content = torch.load(self.checkpoint, map_location="cpu", weights_only=True)
        self.progress = Progress(**content["progress"])
        self.model.load_state_dict(content["model"])
        self.average.load_state_dict(content["average"])
        self.optimizer = build_optimizer(self.model, self.progress.stage, self.recipe.rates)
        self.optimizer.load_state_dict(content["optimizer"])
        torch.set_rng_state(content["random"])

    def log(self, **values: object) -> None:
        """One line of the log, also told on stderr."""
        line = json.dumps({**asdict(self.progress), **values})
        with (self.recipe.out / "log.jsonl").open("a") as stream:
            stream.write(line + "\n")
        sys.stderr.write(line + "\n")

    def start_masks(self) -> None:
        """Stage 2 goes on from the averaged weights."""
        self.model.load_state_dict(self.average.state_dict())
        before = self.progress
        self.progress = Progress(
            stage=2,
            step=before.step,
            samples=before.samples,
            elapsed_s=before.elapsed_s,
            stage_start_s=before.elapsed_s,
        )
        self.optimizer = build_optimizer(self.model, 2, self.recipe.rates)

    def step(self, batch: Batch) -> dict[str, float]:
        """One update; returns the losses by name."""
        share = rate_share(self.progress, self.recipe.cooling_steps)
        for group in self.optimizer.param_groups:
            group["lr"] = group["top"] * share
        self.model.train()
        if self.recipe.start:
            fix_norms(self.model)
        images, targets = as_floats(batch)
        with torch.autocast("cpu", torch.bfloat16, enabled=self.recipe.bfloat16):
            losses = self.model.losses(images, targets, with_masks=self.progress.stage == 2)
        total = torch.stack([loss.float() for loss in losses.values()]).sum()
        self.optimizer.zero_grad(set_to_none=True)
        total.backward()  # type: ignore[no-untyped-call]
        learnt = [p for group in self.optimizer.param_groups for p in group["params"]]
        norm = torch.nn.utils.clip_grad_norm_(learnt, CLIP_NORM)
        if torch.isfinite(norm):
            self.optimizer.step()
        self.progress.step += 1
        self.progress.step_in_stage += 1
        self.progress.samples += len(images)
        update_average(self.average, self.model, self.progress.step_in_stage)
        return {name: round(float(loss.detach()), 4) for name, loss in losses.items()}

    def _validation(self) -> tuple[list[Path], Iterator[Window]]:
        """Shards with masks, and photographs with boxes, that training never sees."""
        kept, count = self.recipe.validation, self.recipe.measured_pictures
        shards = _evenly(list_shards(kept.rendered) or list_shards(kept.drawn), count)
        tiles = list_tiles(kept.real, True, kept.unknown).all() if kept.real else []
        photographs = (tile.read() for tile in _evenly(tiles, count))
        return shards, (window for window in photographs if window is not None)

    def measure(self) -> float | None:
        """Figures of the averaged weights, logged and stored; the one that decides."""
        shards, photographs = self._validation()
        if not shards:
            return None
        boxes = {"rendered": measure_boxes(self.average, (read_window(f) for f in shards))}
        if self.recipe.validation.real:
            boxes["real"] = measure_boxes(self.average, photographs)
        masks = measure(self.average, (read_window(f) for f in shards))
        quality = {**{k: q.to_dict() for k, q in boxes.items()}, "masks": masks.to_dict()}
        self.log(quality=quality)
        about = {"recipe": self.recipe.about(), "progress": asdict(self.progress)}
        save_weights(
            self.average, {**about, "quality": quality}, self.recipe.out / "model.safetensors"
        )
        if self.progress.stage == 2:
            return masks.median_iou
        return sum(q.average_precision for q in boxes.values()) / len(boxes)

    def judge(self, figure: float | None) -> None:
        """Begins to let the rate fall where validation has stopped improving."""
        progress = self.progress
        progress.since_best += 1
        if figure is not None and figure > progress.best:
            progress.best, progress.since_best = figure, 0
        if progress.since_best > self.recipe.patience:
            self._cool()

    def _cool(self) -> None:
        if self.progress.cooling_from_step is None:
            self.progress.cooling_from_step = self.progress.step_in_stage

    def _late(self) -> bool:
        held_s = self.progress.elapsed_s - self.progress.stage_start_s
        return held_s >= 60 * self.recipe.held_minutes[self.progress.stage - 1]

    def stream(self) -> Iterator[Batch]:
        """Batches from the sample where the run stands."""
        recipe = self.recipe
        crops = CropStream(recipe.sources, recipe.crop, recipe.seed, self.progress.samples)
        return batches(crops, recipe.batch)

    def end_of_stage(self) -> None:
        """After the rate has fallen: on to the masks, or the end."""
        cooling, steps = self.progress.cooling_from_step, self.recipe.max_steps
        if steps is not None and self.progress.step >= steps:
            self.finished = True
        if cooling is None or self.progress.step_in_stage < cooling + self.recipe.cooling_steps:
            return
        self.measure()
        if self.progress.stage == 1:
            self.start_masks()
        else:
            self.finished = True

    def train(self) -> None:
        """Both stages, until they are finished or the run is told to stop."""
        torch.set_num_threads(self.recipe.threads)
        stream = self.stream()
        last = time.monotonic()
        saved_s = measured_s = self.progress.elapsed_s
        while not self.finished and not self.stopped:
            losses = self.step(next(stream))
            now = time.monotonic()
            self.progress.elapsed_s += now - last
            if self.progress.step % 20 == 0:
                self.log(losses=losses, rate=self.optimizer.param_groups[0]["lr"])
            elapsed_s = self.progress.elapsed_s
            if elapsed_s - measured_s >= self.recipe.measure_every_s:
                self.judge(self.measure())
                measured_s = elapsed_s
            if self._late():
                self._cool()
            self.end_of_stage()
            if elapsed_s - saved_s >= self.recipe.checkpoint_every_s:
                self.save()
                saved_s = elapsed_s
            last = time.monotonic()
        self.save()
        if self.recipe.max_steps is not None:
            self.measure()


def parse(argv: list[str] | None) -> Recipe:
    """The recipe of a command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rendered", type=Path, help="rendered shards, with train/ and val/")
    parser.add_argument("--drawn", type=Path, help="drawn shards, with train/ and val/")
    parser.add_argument("--real", type=Path, help="folder of photographs with YOLO boxes")
    parser.add_argument("--unknown", type=Path, help="what export.find_unknown wrote of these")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--start", type=Path, help="weights of an earlier run to begin with")
    parser.add_argument("--held-minutes", type=float, nargs=2, default=(600.0, 600.0),
                        help="longest time of each stage at the full rate")  # fmt: skip
    parser.add_argument("--cooling-steps", type=int, default=1500)
    parser.add_argument("--shares", type=float, nargs=len(Kind), default=DEFAULT_SHARES.values(),
                        help=f"of crops from: {', '.join(Kind)}")  # fmt: skip
    parser.add_argument("--first-stage", type=int, choices=(1, 2), default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--batch", type=int, default=4)
    parser.add_argument("--crop", type=int, default=320)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--bfloat16", action="store_true", help="faster where the CPU knows it")
    options = parser.parse_args(argv)
    folders = {"rendered": options.rendered, "drawn": options.drawn}
    train, val = (
        {k: root / part for k, root in folders.items() if root is not None}
        for part in ("train", "val")
    )
    shares = dict(zip(Kind, options.shares, strict=True))
    return Recipe(
        sources=Sources(**train, real=options.real, unknown=options.unknown, shares=shares),
        validation=Sources(**val, real=options.real, unknown=options.unknown),
        out=options.out,
        seed=options.seed,
        batch=options.batch,
        threads=options.threads,
        held_minutes=tuple(options.held_minutes),
        cooling_steps=options.cooling_steps,
        start=options.start,
        first_stage=options.first_stage,
        crop=CropSettings(size_px=options.crop),
        bfloat16=options.bfloat16,
    )


def main(argv: list[str] | None = None) -> int:
    """Trains, or goes on training, and leaves `model.safetensors` in the output folder."""
    run = Run(parse(argv))

    def stop(_signal: int, _frame: object) -> None:
        run.stopped = True

    signal.signal(signal.SIGTERM, stop)
    run.train()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
