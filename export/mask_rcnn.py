"""Mask R-CNN for fruitlets: torchvision's detector on a small plain backbone.

Input is RGB 0..255 at full resolution and of any size; nothing is resized.
Boxes are in pixel-edge coordinates: pixel i covers i to i + 1.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import asdict, dataclass, field
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torchvision.models.detection.anchor_utils import AnchorGenerator
from torchvision.models.detection.faster_rcnn import FastRCNNPredictor, TwoMLPHead
from torchvision.models.detection.image_list import ImageList
from torchvision.models.detection.rpn import RPNHead
from torchvision.ops import FeaturePyramidNetwork, MultiScaleRoIAlign

from export.certainty_head import certainty_loss
from export.mask_branch import (
    MaskBranch,
    MaskShape,
    grow_boxes,
    inside_weight,
    mask_loss,
    soft_targets,
)
from export.roi_ignore import IgnoringBoxHeads, IgnoringRpn

LEVELS = ("p2", "p3", "p4", "p5")
STRIDES = (4, 8, 16, 32)
PIXEL_MEAN = 92.0
PIXEL_SCALE = 58.0
MASKS_PER_IMAGE = 6

Target = dict[str, Tensor]
"""boxes (N, 4), labels (N,) with 1 or -1 (ignored, listed last), masks (K, 2, H, W) 0 to 1.

The masks are those of the first K boxes.
"""


@dataclass(frozen=True, slots=True)
class NetworkShape:
    """Sizes of the network; they are stored in its checkpoints."""

    stem: int = 32
    widths: tuple[int, int, int, int] = (40, 80, 128, 160)
    pyramid: int = 48
    box_hidden: int = 256
    anchors: tuple[tuple[int, ...], ...] = ((14, 24, 38), (56, 84, 124))
    proposals: int = 200
    mask: MaskShape = field(default_factory=MaskShape)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for a checkpoint."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> NetworkShape:
        """The shape that `to_dict` gave."""
        return cls(**{**values, "mask": MaskShape(**values["mask"])})


def _norm_convolution(inputs: int, outputs: int, stride: int) -> list[nn.Module]:
    return [
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False),
        nn.BatchNorm2d(outputs),
    ]


class Residual(nn.Module):
    """Two 3x3 convolutions added to their input."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.body = nn.Sequential(
            *_norm_convolution(width, width, 1),
            nn.ReLU(inplace=True),
            *_norm_convolution(width, width, 1),
        )

    def forward(self, x: Tensor) -> Tensor:
        """Same shape as the input."""
        return F.relu(x + self.body(x))


class Backbone(nn.Module):
    """Plain 3x3 convolutions at strides 2 to 32 and a feature pyramid at 4 to 32."""

    def __init__(self, shape: NetworkShape) -> None:
        super().__init__()
        self.stem = nn.Sequential(*_norm_convolution(3, shape.stem, 2), nn.ReLU(inplace=True))
        inputs = (shape.stem, *shape.widths[:-1])
        self.stages = nn.ModuleList(
            nn.Sequential(
                *_norm_convolution(before, width, 2), nn.ReLU(inplace=True), Residual(width)
            )
            for before, width in zip(inputs, shape.widths, strict=True)
        )
        self.pyramid = FeaturePyramidNetwork(list(shape.widths), shape.pyramid)

    def forward(self, pixels: Tensor) -> dict[str, Tensor]:
        """Pyramid levels by name, finest first."""
        x = self.stem(pixels)
        levels: OrderedDict[str, Tensor] = OrderedDict()
        for name, stage in zip(LEVELS, self.stages, strict=True):
            x = stage(x)
            levels[name] = x
        pyramid: dict[str, Tensor] = self.pyramid(levels)
        return pyramid


def _build_rpn(shape: NetworkShape) -> IgnoringRpn:
    ratios = ((0.6, 1.0, 1.67),) * len(shape.anchors)
    anchors = AnchorGenerator(shape.anchors, ratios)
    # One head serves all levels, so all have the same number of anchors.
    return IgnoringRpn(
        anchors,
        RPNHead(shape.pyramid, anchors.num_anchors_per_location()[0]),
        fg_iou_thresh=0.6,
        bg_iou_thresh=0.3,
        batch_size_per_image=128,
        positive_fraction=0.5,
        pre_nms_top_n={"training": 400, "testing": 600},
        post_nms_top_n={"training": 200, "testing": shape.proposals},
        nms_thresh=0.7,
    )


def _build_box_heads(shape: NetworkShape) -> IgnoringBoxHeads:
    pool = MultiScaleRoIAlign(list(LEVELS[:3]), 7, 2, canonical_scale=56, canonical_level=3)
    return IgnoringBoxHeads(
        pool,
        TwoMLPHead(shape.pyramid * 49, shape.box_hidden),
        FastRCNNPredictor(shape.box_hidden, 2),
        fg_iou_thresh=0.5,
        bg_iou_thresh=0.5,
        batch_size_per_image=96,
        positive_fraction=0.3,
        bbox_reg_weights=None,
        score_thresh=0.05,
        nms_thresh=0.5,
        detections_per_img=100,
    )


def jittered(boxes: Tensor) -> Tensor:
    """Boxes (N, 4) moved and scaled about as much as detected ones differ from the truth."""
    size = boxes[:, 2:] - boxes[:, :2]
    strength = torch.where(torch.rand(len(boxes), 1) < 0.2, 0.10, 0.035).to(boxes)
    centre = 0.5 * (boxes[:, :2] + boxes[:, 2:]) + torch.randn_like(size) * strength * size
    half = 0.5 * size * torch.exp(torch.randn_like(size) * strength * 1.5)
    return torch.cat([centre - half, centre + half], dim=1)


def _chosen(target: Target) -> Tensor:
    """Indices of at most MASKS_PER_IMAGE fruitlets that have a mask."""
    count = len(target["masks"])
    return torch.randperm(count)[:MASKS_PER_IMAGE]


@dataclass(frozen=True, slots=True)
class Detections:
    """What the network finds in one image."""

    boxes: Tensor
    """(N, 4) of the visible part."""
    scores: Tensor
    mask_boxes: Tensor
    """(N, 4) the windows that the logits cover."""
    mask_logits: Tensor
    """(N, 2, M, M): visible part, whole fruitlet."""
    visible_fractions: Tensor
    """(N,) 0 to 1, of the whole fruitlet."""
    width_sds: Tensor
    """(N,) standard deviation of the whole mask's width, as a share of it."""


class FruitletMaskRCNN(nn.Module):
    """Boxes and two masks of each fruitlet."""

    def __init__(self, shape: NetworkShape | None = None) -> None:
        super().__init__()
        self.shape = shape or NetworkShape()
        self.backbone = Backbone(self.shape)
        self.rpn = _build_rpn(self.shape)
        self.box_heads = _build_box_heads(self.shape)
        self.masks = MaskBranch(self.shape.pyramid, STRIDES[0], self.shape.mask)

    def _encode(self, images: Tensor) -> tuple[Tensor, dict[str, Tensor]]:
        height, width = images.shape[-2:]
        pixels = (images - PIXEL_MEAN) / PIXEL_SCALE
        padded = F.pad(pixels, (0, -width % STRIDES[-1], 0, -height % STRIDES[-1]))
        return padded, self.backbone(padded)

    def _propose(
        self,
        padded: Tensor,
        features: dict[str, Tensor],
        size: tuple[int, int],
        targets: list[Target] | None,
    ) -> tuple[list[Tensor], dict[str, Tensor]]:
        levels = {name: features[name] for name in LEVELS[1 : 1 + len(self.shape.anchors)]}
        proposals, losses = self.rpn(ImageList(padded, [size] * len(padded)), levels, targets)
        return proposals, losses

    def losses(self, images: Tensor, targets: list[Target], with_masks: bool) -> dict[str, Tensor]:
        """Training losses by name; images (B, 3, H, W) RGB 0..255."""
        padded, features = self._encode(images)
        size = (images.shape[-2], images.shape[-1])
        proposals, losses = self._propose(padded, features, size, targets)
        losses = {**losses, **self.box_heads.box_losses(features, proposals, size, targets)}
        if with_masks:
            losses |= self._mask_losses(padded, features, size, targets)
        return losses

    def _mask_losses(
        self,
        padded: Tensor,
        features: dict[str, Tensor],
        size: tuple[int, int],
        targets: list[Target],
    ) -> dict[str, Tensor]:
        chosen = [_chosen(t) for t in targets]
        windows = [
            grow_boxes(jittered(t["boxes"][i]), self.shape.mask.growth)
            for t, i in zip(targets, chosen, strict=True)
        ]
        everything = torch.cat(windows)
        if not len(everything):
            return {"loss_mask": padded.sum() * 0.0}
        masks = torch.cat([t["masks"][i] for t, i in zip(targets, chosen, strict=True)])
        logits, certainty = self.masks(padded, features[LEVELS[0]], windows)
        cells = self.shape.mask.cells
        truth = soft_targets(masks, everything, cells)
        inside = inside_weight(everything, size, cells)
        return {
            "loss_mask": mask_loss(logits, truth, inside),
            "loss_certainty": certainty_loss(certainty, logits.float(), truth, inside),
        }

    def detect(self, image: Tensor) -> Detections:
        """Fruitlets in one image (3, H, W) RGB 0..255, best first."""
        padded, features = self._encode(image[None])
        size = (image.shape[-2], image.shape[-1])
        proposals, _ = self._propose(padded, features, size, None)
        boxes, scores = self.box_heads.detect(features, proposals, size)
        windows = grow_boxes(boxes[0], self.shape.mask.growth)
        logits, certainty = self.masks(padded, features[LEVELS[0]], [windows])
        fractions, sds = certainty[:, 0].sigmoid(), certainty[:, 1].exp()
        return Detections(boxes[0], scores[0], windows, logits, fractions, sds)

    def freeze_box_heads(self) -> None:
        """Stage 2 of the paper: the proposal network and the box heads stay as they are."""
        self.rpn.requires_grad_(False)
        self.box_heads.requires_grad_(False)
