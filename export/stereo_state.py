"""A training run that can be stopped at any moment and taken up again."""

from __future__ import annotations

import copy
import json
import math
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch

from export.raft import RaftConfig, RaftStereo
from export.weights_file import load_model, save_tensors

WARM_UP_SHARE = 0.03
FINAL_RATE_SHARE = 0.02
EMA_DECAY = 0.995


@dataclass(slots=True)
class Progress:
    """How far a run has come."""

    batches: int = 0
    seconds: float = 0.0


class TrainingState:
    """Network, averaged network, optimiser and progress."""

    def __init__(self, network: RaftStereo, peak_rate: float, seed: int) -> None:
        torch.manual_seed(seed)
        self.model = network.requires_grad_(True)
        self.average = copy.deepcopy(self.model).eval().requires_grad_(False)
        self.optimizer = torch.optim.AdamW(self.model.parameters(), lr=peak_rate, weight_decay=1e-4)
        self.progress = Progress()
        self._peak_rate = peak_rate

    def set_rate(self, share: float) -> float:
        """Learning rate when `share` (0..1) of the time is spent: short rise, cosine fall."""
        if share < WARM_UP_SHARE:
            rate = self._peak_rate * (0.1 + 0.9 * share / WARM_UP_SHARE)
        else:
            fallen = (min(share, 1.0) - WARM_UP_SHARE) / (1 - WARM_UP_SHARE)
            cosine = 0.5 * (1 + math.cos(math.pi * fallen))
            rate = self._peak_rate * (FINAL_RATE_SHARE + (1 - FINAL_RATE_SHARE) * cosine)
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        return rate

    def update_average(self) -> None:
        """Moves the averaged weights towards the current ones, faster at first."""
        decay = min(EMA_DECAY, (1 + self.progress.batches) / (10 + self.progress.batches))
        current = self.model.state_dict()
        for name, kept in self.average.state_dict().items():
            if kept.dtype.is_floating_point:
                kept.lerp_(current[name], 1 - decay)
            else:
                kept.copy_(current[name])

    def save(self, path: Path) -> None:
        """Writes everything, so that the file is either the old or the new one."""
        partial = path.with_suffix(".partial")
        torch.save(
            {
                "config": self.model.config.as_dict(),
                "model": self.model.state_dict(),
                "average": self.average.state_dict(),
                "optimizer": self.optimizer.state_dict(),
                "progress": asdict(self.progress),
            },
            partial,
        )
        with partial.open("rb") as stream:
            os.fsync(stream.fileno())
        partial.replace(path)

    def restore(self, path: Path) -> None:
        """Continues from a saved run of the same configuration."""
        saved = torch.load(path, map_location="cpu", weights_only=True)
        self.model.load_state_dict(saved["model"])
        self.average.load_state_dict(saved["average"])
        self.optimizer.load_state_dict(saved["optimizer"])
        self.progress = Progress(**saved["progress"])


def save_network(model: RaftStereo, about: dict[str, Any], path: Path) -> None:
    """Weights and configuration as safetensors."""
    save_tensors(model, model.config.as_dict(), about, path)


def load_network(path: Path) -> tuple[RaftStereo, dict[str, Any]]:
    """The network of `save_network`, ready for inference, and its description.

    Raises:
        WeightsError: the file is no network of this kind.
    """
    return load_model(path, lambda config: RaftStereo(RaftConfig.from_dict(config)), "RAFT-Stereo")


def append_line(path: Path, values: dict[str, Any]) -> None:
    """Adds one JSON document as a line."""
    with path.open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(values) + "\n")
