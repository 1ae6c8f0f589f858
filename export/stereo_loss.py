"""What the stereo network is trained to minimise."""

from __future__ import annotations

from dataclasses import dataclass

import torch
import torch.nn.functional as nnf
from torch import Tensor

from export.raft import StereoPrediction
from export.stereo_data import StereoBatch

GAMMA = 0.9
"""Weight of an iteration relative to the next, at the published 16 iterations."""

UNSEEN_WEIGHT = 0.4
"""Weight of pixels without a match, whose disparity follows from what is around."""

RIGHT_PX = 2.0
"""An estimate that is off by less, in px of the input, is one to be confident of."""

FRUIT_WEIGHT = 4.0
"""Weight of pixels on fruitlets: smooth, few, and the only ones that are sized."""

CONFIDENCE_WEIGHT = 1.0
MATCHING_WEIGHT = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class StereoLoss:
    """Terms of the loss, scalars."""

    sequence: Tensor
    confidence: Tensor
    matching: Tensor

    @property
    def total(self) -> Tensor:
        return self.sequence + CONFIDENCE_WEIGHT * self.confidence + MATCHING_WEIGHT * self.matching


def stereo_loss(prediction: StereoPrediction, batch: StereoBatch) -> StereoLoss:
    """L1 of every iteration, cross-entropy of the confidence and of the correlations.

    Confidence is learnt as the chance that the estimate is right, not as the chance
    that the other eye sees the pixel: behind an edge the surface often goes on.
    """
    seen = batch.matched * batch.decided
    weight = batch.known * (UNSEEN_WEIGHT + (1 - UNSEEN_WEIGHT) * seen)
    weight = weight * (1 + (FRUIT_WEIGHT - 1) * batch.fruit)
    weight = weight / weight.sum().clamp(min=1)
    last = len(prediction.disparities) - 1
    gamma = GAMMA ** (15 / max(last, 1))
    sequence = torch.stack(
        [
            gamma ** (last - i) * (weight * (disparity - batch.disparity).abs()).sum()
            for i, disparity in enumerate(prediction.disparities)
        ]
    ).sum()
    error = (prediction.disparities[-1].detach() - batch.disparity).abs()
    right = (batch.known & (error < RIGHT_PX)).float()
    each = nnf.binary_cross_entropy_with_logits(prediction.confidence, right, reduction="none")
    confidence = (each * batch.decided).sum() / batch.decided.sum().clamp(min=1)
    return StereoLoss(sequence, confidence, matching_loss(prediction.volume, batch))


def matching_loss(volume: Tensor, batch: StereoBatch) -> Tensor:
    """Cross-entropy of each left cell's correlations with where its match really is.

    Not part of the published recipe: it teaches the encoder directly, without
    waiting for gradients through the iterations. Cells whose pixels disagree
    or have no match take no part.
    """
    cells = volume.shape[2]
    factor = batch.disparity.shape[3] // cells
    sure = nnf.avg_pool2d(batch.matched * batch.decided, factor).squeeze(1)
    mean = nnf.avg_pool2d(batch.disparity, factor)
    spread = nnf.avg_pool2d(
        (batch.disparity - nnf.interpolate(mean, scale_factor=float(factor))).abs(), factor
    )
    column = torch.arange(cells, device=volume.device) - mean.squeeze(1) / factor
    used = (sure == 1) & (spread.squeeze(1) < 1) & (column >= 0) & (column <= cells - 1)
    before = column.floor().clamp(0, cells - 2)
    fraction = (column - before).clamp(0, 1)
    at = before.long().unsqueeze(-1)
    logs = volume.log_softmax(dim=-1)
    first, second = logs.gather(-1, at).squeeze(-1), logs.gather(-1, at + 1).squeeze(-1)
    entropy = -((1 - fraction) * first + fraction * second)
    return (entropy * used).sum() / used.sum().clamp(min=1)
