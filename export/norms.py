"""Batch normalisation that stays as it is while a network goes on learning."""

from __future__ import annotations

from torch import nn


def fix_norms(model: nn.Module) -> None:
    """Keeps the statistics of all batch normalisations as they are while training."""
    for part in model.modules():
        if isinstance(part, nn.BatchNorm2d):
            part.eval()
