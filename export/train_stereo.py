"""Trains the shipped stereo network: `python -m export.train_stereo --data DIR --out DIR`."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

import torch
from torch.utils.data import DataLoader, Subset

from export.norms import fix_norms
from export.raft import SHIPPED, RaftStereo
from export.stereo_data import (
    StereoBatch,
    StereoBatches,
    drawn_batches,
    validation_batches,
)
from export.stereo_loss import StereoLoss, stereo_loss
from export.stereo_state import TrainingState, append_line, load_network, save_network

SAVE_EVERY_S = 120.0
VALIDATE_EVERY_S = 600.0
LOG_EVERY = 10
CLIP_NORM = 1.0


def main(arguments: list[str] | None = None) -> None:
    """Trains until the time is spent, from where an earlier call stopped."""
    options = _parser().parse_args(arguments)
    torch.set_num_threads(options.threads)
    options.out.mkdir(parents=True, exist_ok=True)
    network = load_network(options.start)[0] if options.start else RaftStereo(SHIPPED)
    network = network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    state = TrainingState(network, options.rate, options.seed)
    checkpoint = options.out / "stereo.pt"
    if checkpoint.exists():
        state.restore(checkpoint)
    asked_to_stop = False

    def stop(_signal: int, _frame: object) -> None:
        nonlocal asked_to_stop
        asked_to_stop = True

    signal.signal(signal.SIGTERM, stop)
    train(state, options, checkpoint, lambda: asked_to_stop)
    if asked_to_stop:
        return
    report = validate(state.average, options.data / "val", options.iterations)
    append_line(options.out / "stereo.jsonl", {"batches": state.progress.batches, **report})
    about = {"recipe": recipe(options, state.progress.batches), "quality": report}
    save_network(state.average, about, options.out / "stereo.safetensors")


def recipe(options: argparse.Namespace, batches: int) -> dict[str, Any]:
    """What the weights depend on, as plain values without paths."""
    return {
        "seed": options.seed,
        "batches": batches,
        "minutes": options.minutes,
        "rate": options.rate,
        "iterations": options.iterations,
        "drawn_share": options.drawn_share,
        "photographs": options.photographs is not None,
        "started_from": load_network(options.start)[1] if options.start else None,
    }


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with train/ and val/")
    parser.add_argument("--out", type=Path, required=True, help="folder for checkpoint and log")
    parser.add_argument("--minutes", type=float, default=60, help="training time in all")
    parser.add_argument("--iterations", type=int, default=5)
    parser.add_argument("--rate", type=float, default=1e-3, help="highest learning rate")
    parser.add_argument("--drawn-share", type=float, default=0.5, help="share of drawn pairs")
    parser.add_argument("--photographs", type=Path, help="their FOLDER/*/images become textures")
    parser.add_argument("--start", type=Path, help="weights of an earlier run to begin with")
    parser.add_argument("--bfloat16", action="store_true", help="faster where the CPU knows it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1, help="processes that prepare batches")
    return parser


def train(
    state: TrainingState,
    options: argparse.Namespace,
    checkpoint: Path,
    stopped: Callable[[], bool],
) -> None:
    """Steps until the budget is spent or the run is stopped; the schedule follows the time."""
    budget = 60 * options.minutes
    log = checkpoint.with_suffix(".jsonl")
    manner = Manner(fixed_norms=options.start is not None, bfloat16=options.bfloat16)
    saved = validated = state.progress.seconds
    before = monotonic()
    for batch in _batches(options, state.progress.batches):
        if state.progress.seconds >= budget or stopped():
            break
        share = state.progress.seconds / budget
        rate = state.set_rate(share)
        # Few iterations suffice while the features are still being learned.
        iterations = max(3, options.iterations - (share < 0.3) - (share < 0.6))
        loss = step(state, batch, iterations, manner)
        state.progress.batches += 1
        now = monotonic()
        state.progress.seconds += now - before
        before = now
        if state.progress.batches % LOG_EVERY == 0:
            append_line(log, _line(state, loss, rate))
        if state.progress.seconds - validated > VALIDATE_EVERY_S:
            validated = state.progress.seconds
            report = validate(state.average, options.data / "val", options.iterations)
            append_line(log, {"batches": state.progress.batches, **report})
        if state.progress.seconds - saved > SAVE_EVERY_S:
            saved = state.progress.seconds
            _save(state, checkpoint)
    _save(state, checkpoint)


def _save(state: TrainingState, checkpoint: Path) -> None:
    """A full disk is told, and training goes on."""
    try:
        state.save(checkpoint)
    except (OSError, RuntimeError) as problem:
        sys.stderr.write(f"The checkpoint could not be written: {problem}\n")


@dataclass(frozen=True, slots=True)
class Manner:
    """How each update is made."""

    fixed_norms: bool = False
    """Keep what batch normalisation knows, as weights of an earlier run want it."""
    bfloat16: bool = False


def step(
    state: TrainingState, batch: StereoBatch, iterations: int, manner: Manner = Manner()
) -> StereoLoss:
    """One update of the network and of its average; a loss that is not finite is skipped."""
    state.model.train()
    if manner.fixed_norms:
        fix_norms(state.model)
    with torch.autocast("cpu", torch.bfloat16, enabled=manner.bfloat16):
        prediction = state.model(batch.left.float(), batch.right.float(), iterations)
    loss = stereo_loss(prediction, batch)
    state.optimizer.zero_grad(set_to_none=True)
    loss.total.backward()  # type: ignore[no-untyped-call]
    norm = torch.nn.utils.clip_grad_norm_(state.model.parameters(), CLIP_NORM)
    if torch.isfinite(norm):
        state.optimizer.step()
        state.update_average()
    return loss


def _batches(options: argparse.Namespace, first: int) -> Iterator[StereoBatch]:
    data = StereoBatches(
        options.data / "train", options.seed, options.drawn_share, options.photographs
    )
    left = Subset(data, range(first, len(data)))
    # A forked child would wait for ever on the thread pools that it did not inherit.
    yield from DataLoader(
        left,
        batch_size=None,
        num_workers=options.workers,
        multiprocessing_context="spawn" if options.workers else None,
        prefetch_factor=4 if options.workers else None,
    )


def _line(state: TrainingState, loss: StereoLoss, rate: float) -> dict[str, float]:
    return {
        "batches": state.progress.batches,
        "seconds": round(state.progress.seconds, 1),
        "rate": round(rate, 7),
        "sequence": round(float(loss.sequence), 4),
        "confidence": round(float(loss.confidence), 4),
        "matching": round(float(loss.matching), 4),
    }


def validate(model: RaftStereo, folder: Path, iterations: int) -> dict[str, float]:
    """Errors on rendered windows kept apart, and on drawn pairs."""
    kinds: dict[str, Iterable[StereoBatch]] = {"drawn": drawn_batches(6)}
    if any(folder.glob("*.npz")):
        kinds["rendered"] = validation_batches(folder, 12)
    report = {}
    for kind, batches in kinds.items():
        for name, value in measure(model, batches, iterations).items():
            report[f"{kind}_{name}"] = round(value, 4)
    return report


@torch.no_grad()
def measure(model: RaftStereo, batches: Iterable[StereoBatch], iterations: int) -> dict[str, float]:
    """End-point error of matched pixels in input px, and how well confidence tells them."""
    model.eval()
    errors, hits, signed = [], [], []
    for batch in batches:
        found, logit = model.predict(batch.left.float(), batch.right.float(), iterations)
        used = batch.decided & (batch.matched > 0)
        errors.append((found - batch.disparity).abs()[used])
        signed.append((found - batch.disparity)[used & batch.fruit])
        hits.append(((logit > 0) == (batch.matched > 0))[batch.decided].float())
    error, hit, on_fruit = torch.cat(errors), torch.cat(hits), torch.cat(signed)
    fruit = (
        {
            "fruit_median_px": float(on_fruit.abs().median()),
            "fruit_bias_px": float(on_fruit.median()),
        }
        if len(on_fruit)
        else {}
    )
    return {
        **fruit,
        "epe_px": float(error.mean()),
        "median_px": float(error.median()),
        "over_1_px": float((error > 1).float().mean()),
        "confidence_right": float(hit.mean()),
    }


if __name__ == "__main__":
    main()
