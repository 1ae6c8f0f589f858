"""Trains Mask R-CNN in the paper's two stages: boxes, then masks.

    python -m export.train_segmentation --data export/.cache/orchard \\
        --drawn export/.cache/drawn --out export/.cache/segmentation --minutes 60

Stage 1 trains the backbone, the proposal network and the box heads. Stage 2
freezes the proposal network and the box heads and trains the mask branch. The
backbone goes on learning gently, with the box losses still on it: frozen heads
then stay right for features that move. Started again, the command goes on
where the last checkpoint was written.
"""

from __future__ import annotations

import argparse
import json
import math
import signal
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch
from torch import Tensor
from torch.optim import AdamW

from export.mask_rcnn import FruitletMaskRCNN, NetworkShape
from export.segmentation_data import (
    Batch,
    CropSettings,
    CropStream,
    Sources,
    batches,
    list_shards,
    read_window,
)
from export.segmentation_quality import Quality, measure
from export.segmentation_state import (
    Progress,
    averaged_copy,
    load_weights,
    save_atomically,
    save_weights,
    update_average,
)

WARMUP_STEPS = 100
LAST_RATE_SHARE = 0.01
CLIP_NORM = 5.0
WEIGHT_DECAY = 0.02
BOX_RATE = 1.5e-3
MASK_RATE = 2e-3
BACKBONE_RATE_IN_STAGE_TWO = 4e-4


@dataclass(frozen=True, slots=True)
class Recipe:
    """All that a run depends on."""

    rendered: Path | None
    drawn: Path | None
    out: Path
    minutes: float
    seed: int = 1
    batch: int = 4
    threads: int = 2
    drawn_share: float = 0.35
    stage_one_share: float = 0.45
    crop: CropSettings = field(default_factory=CropSettings)
    shape: NetworkShape = field(default_factory=NetworkShape)
    checkpoint_every_s: float = 120.0
    measure_every_s: float = 480.0
    measured_windows: int = 30
    max_steps: int | None = None
    start: Path | None = None
    """Weights of an earlier run to begin with, in place of random ones."""

    def about(self) -> dict[str, Any]:
        """Plain values for the log and the manifest; no paths."""
        return {
            "minutes": self.minutes,
            "seed": self.seed,
            "batch": self.batch,
            "crop": asdict(self.crop),
            "drawn_share": self.drawn_share,
            "started_from": load_weights(self.start)[1] if self.start else None,
            "stage_one_share": self.stage_one_share,
            "rates": [BOX_RATE, MASK_RATE, BACKBONE_RATE_IN_STAGE_TWO],
            "weight_decay": WEIGHT_DECAY,
        }

    @property
    def stage_one_s(self) -> float:
        return self.stage_one_share * self.minutes * 60


def _folder(root: Path | None, part: str) -> Path | None:
    return root / part if root is not None else None


def rate_share(progress: Progress, end_s: float) -> float:
    """Warm-up, then a cosine until the stage's end."""
    span = max(end_s - progress.stage_start_s, 1e-6)
    done = min(max((progress.elapsed_s - progress.stage_start_s) / span, 0.0), 1.0)
    cosine = 0.5 * (1 + math.cos(math.pi * done))
    warm = min(1.0, (progress.step_in_stage + 1) / WARMUP_STEPS)
    return warm * (LAST_RATE_SHARE + (1 - LAST_RATE_SHARE) * cosine)


def build_optimizer(model: FruitletMaskRCNN, stage: int) -> AdamW:
    """Parameter groups of a stage with their highest rate; freezes what it must."""
    model.requires_grad_(True)
    if stage == 1:
        model.masks.requires_grad_(False)
        learnt = [*model.backbone.parameters(), *model.rpn.parameters()]
        groups = [{"params": [*learnt, *model.box_heads.parameters()], "top": BOX_RATE}]
    else:
        model.freeze_box_heads()
        groups = [
            {"params": list(model.masks.parameters()), "top": MASK_RATE},
            {"params": list(model.backbone.parameters()), "top": BACKBONE_RATE_IN_STAGE_TWO},
        ]
    return AdamW(groups, lr=BOX_RATE, weight_decay=WEIGHT_DECAY)


def as_floats(batch: Batch) -> tuple[Tensor, list[dict[str, Tensor]]]:
    """Images as float and masks as shares."""
    images, targets = batch
    pixels = images.float().contiguous(memory_format=torch.channels_last)
    return pixels, [{**t, "masks": t["masks"].float() / 255.0} for t in targets]


class Run:
    """A training run: its state, one step, and what is written along the way."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self.progress = Progress()
        torch.manual_seed(recipe.seed)
        fresh = load_weights(recipe.start)[0] if recipe.start else FruitletMaskRCNN(recipe.shape)
        self.model = fresh.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.average = averaged_copy(self.model)
        self.optimizer = build_optimizer(self.model, 1)
        self.checkpoint = recipe.out / "last.pt"
        self.stopped = False
        recipe.out.mkdir(parents=True, exist_ok=True)
        if self.checkpoint.exists():
            self.load()

    def save(self) -> None:
        """The whole state, atomically."""
        content = {
            "progress": asdict(self.progress),
            "model": self.model.state_dict(),
            "average": self.average.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "random": torch.get_rng_state(),
        }
        save_atomically(content, self.checkpoint)

    def load(self) -> None:
        """Takes up the state of the last checkpoint."""
        content = torch.load(self.checkpoint, map_location="cpu", weights_only=True)
        self.progress = Progress(**content["progress"])
        self.model.load_state_dict(content["model"])
        self.average.load_state_dict(content["average"])
        self.optimizer = build_optimizer(self.model, self.progress.stage)
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
        self.progress.stage = 2
        self.progress.step_in_stage = 0
        self.progress.stage_start_s = self.progress.elapsed_s
        self.optimizer = build_optimizer(self.model, 2)

    def step(self, batch: Batch) -> dict[str, float]:
        """One update; returns the losses by name."""
        last_stage = self.progress.stage == 2
        end_s = self.recipe.minutes * 60 if last_stage else self.recipe.stage_one_s
        share = rate_share(self.progress, end_s)
        for group in self.optimizer.param_groups:
            group["lr"] = group["top"] * share
        self.model.train()
        images, targets = as_floats(batch)
        losses = self.model.losses(images, targets, with_masks=self.progress.stage == 2)
        total = torch.stack(list(losses.values())).sum()
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

    def measure(self) -> Quality | None:
        """Quality of the averaged weights on validation windows, logged and stored."""
        files = list_shards(_folder(self.recipe.rendered, "val") or Path())
        files = files or list_shards(_folder(self.recipe.drawn, "val") or Path())
        if not files:
            return None
        count = self.recipe.measured_windows
        quality = measure(self.average, (read_window(f) for f in files[:: -(-len(files) // count)]))
        self.log(quality=quality.to_dict())
        about = {
            "recipe": self.recipe.about(),
            "progress": asdict(self.progress),
            "quality": quality.to_dict(),
        }
        save_weights(self.average, about, self.recipe.out / "model.pt")
        return quality

    def stream(self) -> Iterator[Batch]:
        """Batches from the sample where the run stands."""
        recipe = self.recipe
        sources = Sources(
            _folder(recipe.rendered, "train"), _folder(recipe.drawn, "train"), recipe.drawn_share
        )
        crops = CropStream(sources, recipe.crop, recipe.seed, self.progress.samples)
        return batches(crops, recipe.batch)

    def finished(self) -> bool:
        """The time budget or the given number of steps is used up."""
        steps = self.recipe.max_steps
        late = self.progress.elapsed_s >= self.recipe.minutes * 60
        return late or (steps is not None and self.progress.step >= steps)

    def train(self) -> Quality | None:
        """Both stages until the budget is used up or the run is told to stop."""
        torch.set_num_threads(self.recipe.threads)
        stream = self.stream()
        last = time.monotonic()
        saved_s = measured_s = self.progress.elapsed_s
        while not self.finished() and not self.stopped:
            losses = self.step(next(stream))
            now = time.monotonic()
            self.progress.elapsed_s += now - last
            last = now
            if self.progress.step % 20 == 0:
                self.log(losses=losses, rate=self.optimizer.param_groups[0]["lr"])
            elapsed_s = self.progress.elapsed_s
            if self.progress.stage == 1 and elapsed_s >= self.recipe.stage_one_s:
                self.start_masks()
            if elapsed_s - saved_s >= self.recipe.checkpoint_every_s:
                self.save()
                saved_s = elapsed_s
            due = elapsed_s - measured_s >= self.recipe.measure_every_s
            if due and self.progress.stage == 2:
                self.measure()
                measured_s = elapsed_s
        self.save()
        return None if self.stopped else self.measure()


def parse(argv: list[str] | None) -> Recipe:
    """The recipe of a command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, help="rendered shards, with train/ and val/")
    parser.add_argument("--drawn", type=Path, help="drawn shards, with train/ and val/")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--minutes", type=float, required=True, help="budget of both stages")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--batch", type=int, default=4)
    parser.add_argument("--crop", type=int, default=320)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--drawn-share", type=float, default=0.35)
    parser.add_argument("--stage-one-share", type=float, default=0.45, help="of the minutes")
    parser.add_argument("--start", type=Path, help="weights of an earlier run to begin with")
    options = parser.parse_args(argv)
    return Recipe(
        rendered=options.data,
        drawn=options.drawn,
        out=options.out,
        minutes=options.minutes,
        seed=options.seed,
        batch=options.batch,
        threads=options.threads,
        drawn_share=options.drawn_share,
        stage_one_share=options.stage_one_share,
        start=options.start,
        crop=CropSettings(size_px=options.crop),
    )


def main(argv: list[str] | None = None) -> int:
    """Trains, or goes on training, and leaves `model.pt` in the output folder."""
    run = Run(parse(argv))

    def stop(_signal: int, _frame: object) -> None:
        run.stopped = True

    signal.signal(signal.SIGTERM, stop)
    run.train()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
