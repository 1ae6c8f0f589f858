"""All-pairs correlation along a row, looked up around the current estimate."""

from __future__ import annotations

import math

import torch
import torch.nn.functional as nnf
from torch import Tensor


def correlate(left: Tensor, right: Tensor) -> Tensor:
    """Dot products of every left with every right cell of its row.

    (B, C, H, W) twice to (B, H, W, W), the last axis over right columns,
    divided by sqrt(C).
    """
    volume = left.permute(0, 2, 3, 1) @ right.permute(0, 2, 1, 3)
    return volume / math.sqrt(left.shape[1])


class CorrelationPyramid:
    """The volume at several poolings of the right columns."""

    def __init__(self, volume: Tensor, levels: int, radius: int) -> None:
        self.radius = radius
        self.levels: list[Tensor] = []
        for level in range(levels):
            if level:
                volume = nnf.avg_pool2d(volume, (1, 2), stride=(1, 2))
            # One zero on either side stands for everything outside the row.
            self.levels.append(nnf.pad(volume, (1, 1)))

    def lookup(self, column: Tensor) -> Tensor:
        """Linear samples at column - radius .. column + radius of each level.

        `column` (B, 1, H, W) is the matched right column in cells; gives
        (B, levels * (2 * radius + 1), H, W).
        """
        column = column.squeeze(1).unsqueeze(-1)
        taps = torch.arange(-self.radius, self.radius + 2, device=column.device)
        found = []
        for level, volume in enumerate(self.levels):
            at = column / 2**level
            whole = at.floor()
            index = (whole.long() + 1 + taps).clamp(min=0).clamp(max=volume.shape[-1] - 1)
            sampled = volume.gather(-1, index)
            fraction = at - whole
            found.append(sampled[..., :-1] * (1 - fraction) + sampled[..., 1:] * fraction)
        return torch.cat(found, dim=-1).permute(0, 3, 1, 2).contiguous()
