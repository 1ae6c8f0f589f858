"""torchvision's detector stages, taught to leave some boxes out of the loss.

A fruitlet of which almost nothing shows is neither a fruitlet to be found nor
background to be learnt. Targets name it with label -1; anchors and proposals
on it are then sampled neither as positives nor as negatives.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torchvision.models.detection.roi_heads import RoIHeads, fastrcnn_loss
from torchvision.models.detection.rpn import RegionProposalNetwork
from torchvision.ops import box_area, box_iou

IGNORED = -1
"""Label of a target, and of an anchor or proposal, that takes no part in the loss."""

IGNORE_IOU = 0.3
IGNORE_COVER = 0.6


def on_ignored(boxes: Tensor, ignored: Tensor) -> Tensor:
    """(N,) bool: boxes (N, 4) that overlap or mostly lie on one of `ignored` (K, 4)."""
    if not len(ignored):
        return torch.zeros(len(boxes), dtype=torch.bool, device=boxes.device)
    low = torch.maximum(boxes[:, None, :2], ignored[None, :, :2])
    high = torch.minimum(boxes[:, None, 2:], ignored[None, :, 2:])
    shared = (high - low).clamp(min=0).prod(dim=2)
    covered = shared / box_area(boxes).clamp(min=1e-6)[:, None]
    hit = (covered > IGNORE_COVER) | (box_iou(boxes, ignored) > IGNORE_IOU)
    return torch.any(hit, dim=1)


class IgnoringRpn(RegionProposalNetwork):  # type: ignore[misc]
    """The proposal network; targets with label -1 are neither positive nor negative."""

    def assign_targets_to_anchors(
        self, anchors: list[Tensor], targets: list[dict[str, Tensor]]
    ) -> tuple[list[Tensor], list[Tensor]]:
        """Labels 1, 0 or -1 for each anchor and the box that it should become."""
        kept = [{"boxes": t["boxes"][t["labels"] > 0]} for t in targets]
        labels, matched = super().assign_targets_to_anchors(anchors, kept)
        for own, boxes, target in zip(labels, anchors, targets, strict=True):
            ignored = target["boxes"][target["labels"] == IGNORED]
            own[(own == 0) & on_ignored(boxes, ignored)] = IGNORED
        return labels, matched


class IgnoringBoxHeads(RoIHeads):  # type: ignore[misc]
    """The box heads without masks; targets must list ignored boxes after the others."""

    def assign_targets_to_proposals(
        self, proposals: list[Tensor], gt_boxes: list[Tensor], gt_labels: list[Tensor]
    ) -> tuple[list[Tensor], list[Tensor]]:
        """Index of the matched target and its label (0 background, -1 ignored)."""
        kept = [labels > 0 for labels in gt_labels]
        matched, labels = super().assign_targets_to_proposals(
            proposals,
            [b[k] for b, k in zip(gt_boxes, kept, strict=True)],
            [c[k] for c, k in zip(gt_labels, kept, strict=True)],
        )
        for own, boxes, truth, keep in zip(labels, proposals, gt_boxes, kept, strict=True):
            own[(own == 0) & on_ignored(boxes, truth[~keep])] = IGNORED
        return matched, labels

    def box_losses(
        self,
        features: dict[str, Tensor],
        proposals: list[Tensor],
        size: tuple[int, int],
        targets: list[dict[str, Tensor]],
    ) -> dict[str, Tensor]:
        """Classification and regression loss over a sample of the proposals."""
        chosen, _, labels, regression = self.select_training_samples(list(proposals), targets)
        logits, offsets = self.predict(features, chosen, size)
        of_class, of_box = fastrcnn_loss(logits, offsets, labels, regression)
        return {"loss_classifier": of_class, "loss_box_reg": of_box}

    def predict(
        self, features: dict[str, Tensor], proposals: list[Tensor], size: tuple[int, int]
    ) -> tuple[Tensor, Tensor]:
        """Class logits and box offsets of each proposal."""
        pooled = self.box_roi_pool(features, proposals, [size] * len(proposals))
        logits, offsets = self.box_predictor(self.box_head(pooled))
        return logits, offsets

    def detect(
        self, features: dict[str, Tensor], proposals: list[Tensor], size: tuple[int, int]
    ) -> tuple[list[Tensor], list[Tensor]]:
        """Boxes and scores of each image, best first."""
        logits, offsets = self.predict(features, proposals, size)
        boxes, scores, _ = self.postprocess_detections(
            logits, offsets, proposals, [size] * len(proposals)
        )
        return boxes, scores
