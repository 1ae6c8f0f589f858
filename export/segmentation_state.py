"""Averaged weights and resumable checkpoints of a segmentation training run."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import nn

from export.mask_rcnn import FruitletMaskRCNN, NetworkShape
from export.weights_file import load_model, save_tensors

EMA_DECAY = 0.997


@dataclass(slots=True)
class Progress:
    """How far a run has come."""

    stage: int = 1
    step: int = 0
    step_in_stage: int = 0
    elapsed_s: float = 0.0
    stage_start_s: float = 0.0
    samples: int = 0
    best: float = -math.inf
    """Best validation figure of the stage so far."""
    since_best: int = 0
    """Validations since then."""
    cooling_from_step: int | None = None
    """Step of the stage at which the rate began to fall; nothing while it is held."""


def averaged_copy(model: FruitletMaskRCNN) -> FruitletMaskRCNN:
    """A copy that gathers the average of the weights; it is never trained."""
    average = copy.deepcopy(model)
    average.requires_grad_(False)
    average.eval()
    return average


@torch.no_grad()
def update_average(average: nn.Module, model: nn.Module, updates: int) -> None:
    """Moves the average towards the weights; early updates count more."""
    decay = min(EMA_DECAY, (1 + updates) / (10 + updates))
    current = model.state_dict()
    for name, value in average.state_dict().items():
        if value.is_floating_point():
            value.lerp_(current[name], 1 - decay)
        else:
            value.copy_(current[name])


def save_atomically(content: dict[str, Any], path: Path) -> None:
    """Writes beside the target, then renames: a reader never sees half a file."""
    part = path.with_suffix(".part")
    torch.save(content, part)
    part.replace(path)


def save_weights(model: FruitletMaskRCNN, about: dict[str, Any], path: Path) -> None:
    """Weights and shape as safetensors; `about` goes to the manifest."""
    save_tensors(model, model.shape.to_dict(), about, path)


def load_weights(path: Path) -> tuple[FruitletMaskRCNN, dict[str, Any]]:
    """The network of `save_weights`, ready for inference, and its description.

    Raises:
        WeightsError: the file is no network of this kind.
    """
    return load_model(
        path, lambda shape: FruitletMaskRCNN(NetworkShape.from_dict(shape)), "Mask R-CNN"
    )
