"""Weights as safetensors, with the shape of their network and how they came about.

A lab that trains further begins from these files; they hold no code.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

Model = TypeVar("Model", bound=nn.Module)


class WeightsError(ValueError):
    """The file is not what it is taken for; one sentence."""


def save_tensors(
    model: nn.Module, shape: dict[str, Any], about: dict[str, Any], path: Path
) -> None:
    """Writes beside the target, then renames: a reader never sees half a file."""
    notes = {"shape": json.dumps(shape), "about": json.dumps(about)}
    weights = {name: value.contiguous().clone() for name, value in model.state_dict().items()}
    part = path.with_suffix(".part")
    save_file(weights, part, metadata=notes)
    part.replace(path)


def load_model(
    path: Path, build: Callable[[dict[str, Any]], Model], kind: str
) -> tuple[Model, dict[str, Any]]:
    """The network of `save_tensors`, ready for inference, and what is told about it.

    `build` makes the network of a shape, and `kind` names it.

    Raises:
        WeightsError: the file is no network of this kind.
    """
    weights, shape, about = load_tensors(path)
    try:
        model = build(shape)
        model.load_state_dict(weights)
    except (TypeError, KeyError, ValueError, RuntimeError) as problem:
        raise WeightsError(f"{path.name} holds another network than {kind}.") from problem
    model.eval()
    return model, about


def load_tensors(path: Path) -> tuple[dict[str, Tensor], dict[str, Any], dict[str, Any]]:
    """Weights by name, the network's shape, and what is told about them.

    Raises:
        WeightsError: the file cannot be read as one that `save_tensors` wrote.
    """
    try:
        with safe_open(path, "pt") as file:
            notes = file.metadata() or {}
            weights = {name: torch.as_tensor(file.get_tensor(name)) for name in list(file.keys())}
        return weights, json.loads(notes["shape"]), json.loads(notes["about"])
    except (OSError, SafetensorError, KeyError, ValueError) as problem:
        raise WeightsError(f"{path.name} holds no weights of this project: {problem}") from problem
