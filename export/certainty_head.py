"""How much of a fruitlet shows, and how far off its width may be.

A small head on what the mask branch has seen of one box. It is told what was
really hidden and how far off the mask's own width was, and never moves the
masks: its input is detached.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F

WIDTH = 24
MIN_LOG_SD, MAX_LOG_SD = -6.0, 1.0
"""0.25 % of the width to three times the width."""
MIN_AXIS_CELLS2 = 1e-3


class CertaintyHead(nn.Module):
    """(N, 2): logit of the visible fraction, log of the width's relative error."""

    def __init__(self, feature_width: int) -> None:
        super().__init__()
        steps: list[nn.Module] = []
        inputs = feature_width + 2
        for _ in range(3):
            steps += [nn.Conv2d(inputs, WIDTH, 3, 2, 1), nn.ReLU(inplace=True)]
            inputs = WIDTH
        self.body = nn.Sequential(*steps)
        self.out = nn.Sequential(nn.Linear(2 * WIDTH, 32), nn.ReLU(inplace=True), nn.Linear(32, 2))

    def forward(self, features: Tensor, logits: Tensor) -> Tensor:
        """features (N, width, M, M) and mask logits (N, 2, M, M) of the same cells."""
        seen = torch.cat([features.detach(), logits.detach().clamp(-8, 8)], dim=1)
        cells = self.body(seen)
        pooled = torch.cat([cells.mean(dim=(2, 3)), cells.amax(dim=(2, 3))], dim=1)
        certainty: Tensor = self.out(pooled)
        return certainty


def short_axes(shares: Tensor) -> Tensor:
    """(N,) short axes, in cells, of the ellipses with the second moments of (N, M, M) shares."""
    cells = shares.shape[-1]
    at = torch.arange(cells, device=shares.device, dtype=shares.dtype)
    total = shares.sum(dim=(1, 2)).clamp(min=1e-6)
    across, down = shares.sum(dim=1), shares.sum(dim=2)
    x, y = (across * at).sum(dim=1) / total, (down * at).sum(dim=1) / total
    dx, dy = at - x[:, None], at - y[:, None]
    xx, yy = (across * dx**2).sum(dim=1) / total, (down * dy**2).sum(dim=1) / total
    xy = (shares * dy[:, :, None] * dx[:, None, :]).sum(dim=(1, 2)) / total
    middle, half = (xx + yy) / 2, torch.sqrt(((xx - yy) / 2) ** 2 + xy**2)
    return 4 * torch.sqrt((middle - half).clamp(min=MIN_AXIS_CELLS2))


def certainty_loss(certainty: Tensor, logits: Tensor, targets: Tensor, inside: Tensor) -> Tensor:
    """Cross-entropy of the visible fraction, likelihood of the width's error; 0 without fruitlets.

    certainty: (N, 2). logits, targets: (N, 2, M, M) visible and whole. inside: (N, 1, M, M),
    0 where the picture ends: fruitlets that it cuts say nothing of their width.
    """
    if not len(certainty):
        return certainty.sum() * 0.0
    visible, whole = targets[:, 0], targets[:, 1]
    fraction = visible.sum(dim=(1, 2)) / whole.sum(dim=(1, 2)).clamp(min=1e-6)
    uncut = (inside.amin(dim=(1, 2, 3)) > 0).float()
    shown = F.binary_cross_entropy_with_logits(
        certainty[:, 0], fraction.clamp(0, 1), reduction="none"
    )
    error = (short_axes(logits.detach()[:, 1].sigmoid()) / short_axes(whole) - 1).abs()
    log_sd = certainty[:, 1].clamp(MIN_LOG_SD, MAX_LOG_SD)
    # Laplace rather than Gauss: one fruitlet that is quite wrong must not speak for all.
    likelihood = log_sd + 2**0.5 * error * torch.exp(-log_sd)
    return ((shown + likelihood) * uncut).sum() / uncut.sum().clamp(min=1.0)
