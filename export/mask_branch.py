"""The mask branch: grown boxes, soft targets, head and loss.

Boxes are in pixel-edge coordinates: pixel i covers i to i + 1, so that its
centre is at i + 0.5 (`roi_align` with aligned=True).

A mask's edge is wanted to a fraction of a cell. The target of a cell is
therefore the share of a Gaussian window that the fruitlet fills, not a yes or
no. Across a straight edge such a target is the normal distribution of the
distance, its logit is nearly linear, and the line where interpolated logits
are 0 lies on the true edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torchvision.ops import roi_align

from export.certainty_head import CertaintyHead

EDGE_SIGMA_CELLS = 0.6
EDGE_WEIGHT = 4.0
"""How much more a cell on the edge counts than one far from it."""

BLUR_RADIUS = 2


def grow_boxes(boxes: Tensor, factor: float) -> Tensor:
    """(N, 4) boxes with sides multiplied by `factor` about their centres."""
    low, high = boxes[:, :2], boxes[:, 2:]
    margin = (high - low) * (0.5 * (factor - 1.0))
    return torch.cat([low - margin, high + margin], dim=1)


def as_rois(boxes: list[Tensor]) -> Tensor:
    """(N, 5) rows of image index and box, for `roi_align`."""
    rows = [F.pad(b, (1, 0), value=float(i)) for i, b in enumerate(boxes)]
    return torch.cat(rows)


def _gaussian_kernel(sigma: float) -> Tensor:
    offsets = torch.arange(-BLUR_RADIUS, BLUR_RADIUS + 1, dtype=torch.float32)
    weights = torch.exp(-0.5 * (offsets / sigma) ** 2)
    return weights / weights.sum()


def blur_cells(values: Tensor, sigma: float) -> Tensor:
    """(N, C, M, M) Gaussian blur; the border is continued outwards."""
    kernel = _gaussian_kernel(sigma).to(values)
    count = values.shape[1]
    padded = F.pad(values, (BLUR_RADIUS,) * 4, mode="replicate")
    across = F.conv2d(padded, kernel.view(1, 1, 1, -1).expand(count, 1, 1, -1), groups=count)
    return F.conv2d(across, kernel.view(1, 1, -1, 1).expand(count, 1, -1, 1), groups=count)


def soft_targets(masks: Tensor, windows: Tensor, cells: int) -> Tensor:
    """(N, C, cells, cells) share of each cell's Gaussian window that is fruitlet.

    masks: (N, C, H, W) float 0 to 1 in image pixels, one stack for each window.
    windows: (N, 4) grown boxes.
    """
    if not len(windows):
        return masks.new_zeros((0, masks.shape[1], cells, cells))
    rois = F.pad(windows, (1, 0))
    rois[:, 0] = torch.arange(len(windows), dtype=rois.dtype)
    # A negative ratio samples every pixel under a cell: an area average.
    averaged = roi_align(masks, rois, (cells, cells), 1.0, sampling_ratio=-1, aligned=True)
    return blur_cells(averaged, EDGE_SIGMA_CELLS)


def inside_weight(windows: Tensor, size: tuple[int, int], cells: int) -> Tensor:
    """(N, 1, cells, cells) 1 where a cell's centre lies inside the image of `size` (H, W)."""
    steps = (torch.arange(cells, device=windows.device) + 0.5) / cells
    x = windows[:, 0:1] + (windows[:, 2:3] - windows[:, 0:1]) * steps
    y = windows[:, 1:2] + (windows[:, 3:4] - windows[:, 1:2]) * steps
    across = (x >= 0) & (x <= size[1])
    down = (y >= 0) & (y <= size[0])
    return (down[:, None, :, None] & across[:, None, None, :]).float()


def mask_loss(logits: Tensor, targets: Tensor, inside: Tensor) -> Tensor:
    """Cross-entropy against soft targets, heavier on the edge; 0 without fruitlets."""
    if not len(logits):
        return logits.sum() * 0.0
    weight = inside * (1.0 + EDGE_WEIGHT * 4.0 * targets * (1.0 - targets))
    each = F.binary_cross_entropy_with_logits(logits, targets, reduction="none")
    return (each * weight).sum() / weight.sum().clamp(min=1.0)


@dataclass(frozen=True, slots=True)
class MaskShape:
    """Sizes of the mask branch."""

    cells: int = 56
    growth: float = 1.4
    width: int = 64
    detail_width: int = 24
    joined_width: int = 32
    depth: int = 2


def _convolution(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class MaskBranch(nn.Module):
    """Two masks for each box: channel 0 the visible part, channel 1 the whole fruitlet.

    Meaning comes from the pyramid's finest level at half of the mask's
    resolution, edges from the box's own pixels at twice the mask's resolution:
    the pixels are sampled in proportion to the box, so an edge looks alike on
    a small and on a large fruitlet.
    """

    def __init__(self, feature_width: int, stride: int, shape: MaskShape) -> None:
        super().__init__()
        self.shape = shape
        self.stride = stride
        self.meaning = nn.Sequential(
            *[
                _convolution(feature_width if i == 0 else shape.width, shape.width)
                for i in range(shape.depth)
            ],
            nn.ConvTranspose2d(shape.width, shape.detail_width, 2, 2),
            nn.ReLU(inplace=True),
        )
        self.detail = nn.Sequential(
            _convolution(3, shape.detail_width, stride=2),
            _convolution(shape.detail_width, shape.detail_width),
        )
        self.joined = nn.Sequential(
            _convolution(2 * shape.detail_width, shape.joined_width),
            _convolution(shape.joined_width, shape.joined_width),
            nn.Conv2d(shape.joined_width, 2, 1),
        )
        self.certainty = CertaintyHead(shape.joined_width)

    def forward(
        self, pixels: Tensor, features: Tensor, windows: list[Tensor]
    ) -> tuple[Tensor, Tensor]:
        """(N, 2, cells, cells) logits and (N, 2) certainty of the windows of all images.

        pixels: (B, 3, H, W) normalised; features: (B, width, H/stride, W/stride).
        """
        rois = as_rois(windows)
        cells = self.shape.cells
        # A 3x3 convolution of stride s, padding 1 is centred on pixel s*k, whose
        # edge coordinate is s*k + 0.5: shift by half a pixel, sample unaligned.
        shifted = torch.cat([rois[:, :1], rois[:, 1:] - 0.5], dim=1)
        half = (cells // 2, cells // 2)
        coarse = roi_align(features, shifted, half, 1.0 / self.stride, 2, aligned=False)
        fine = roi_align(pixels, rois, (2 * cells, 2 * cells), 1.0, 1, aligned=True)
        both = torch.cat([self.meaning(coarse), self.detail(fine)], dim=1)
        seen: Tensor = self.joined[:-1](both)
        logits: Tensor = self.joined[-1](seen)
        return logits, self.certainty(seen, logits)
