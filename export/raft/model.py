"""RAFT-Stereo: iterative refinement of the disparity of a rectified pair."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import torch
import torch.nn.functional as nnf
from torch import Tensor, nn

from export.raft.config import Norm, RaftConfig
from export.raft.correlation import CorrelationPyramid, correlate
from export.raft.encoder import ContextEncoder, FeatureEncoder, ResidualBlock
from export.raft.update import UpdateBlock

SURELY_MATCHED = 10.0
"""Confidence logit of a network that has no head for it."""


@dataclass(frozen=True, slots=True, eq=False)
class StereoPrediction:
    """What training compares with the truth."""

    disparities: list[Tensor]
    """(B, 1, h, w) in input px after each iteration, positive further left."""
    confidence: Tensor
    """(B, 1, h, w) logit that a pixel is matched."""
    volume: Tensor
    """(B, H, W, W) correlation of cells."""


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    flow: Tensor
    state: Tensor


@dataclass(frozen=True, slots=True, eq=False)
class _Start:
    states: list[Tensor]
    context: list[Tensor]
    volume: Tensor


class RaftStereo(nn.Module):
    """The published network; `config` also scales it down."""

    def __init__(self, config: RaftConfig) -> None:
        super().__init__()
        self.config = config
        wide, dims = config.encoder_widths[2], config.hidden_dims[::-1]
        self.cnet = ContextEncoder(config)
        self.update_block = UpdateBlock(config)
        self.context_zqr_convs = nn.ModuleList(
            nn.Conv2d(dim, 3 * dim, 3, padding=1) for dim in dims[: config.n_gru_layers]
        )
        if config.shared_backbone:
            self.conv2 = nn.Sequential(
                ResidualBlock(wide, wide, Norm.INSTANCE),
                nn.Conv2d(wide, config.feature_dim, 3, padding=1),
            )
        else:
            self.fnet = FeatureEncoder(config)
        self.confidence_head: nn.Sequential | None = None
        if config.confidence:
            self.confidence_head = nn.Sequential(
                nn.Conv2d(dims[0], 32, 3, padding=1), nn.ReLU(inplace=True), nn.Conv2d(32, 1, 1)
            )

    def forward(self, left: Tensor, right: Tensor, iterations: int) -> StereoPrediction:
        """All intermediate disparities, for training; inputs as in `predict`."""
        start = self._start(left, right)
        disparities = []
        for step in self._refine(start, iterations):
            weights = self._weights(step.state)
            disparities.append(self._disparity(step, weights))
        return StereoPrediction(disparities, self._confidence(step, weights), start.volume)

    def predict(self, left: Tensor, right: Tensor, iterations: int) -> tuple[Tensor, Tensor]:
        """Disparity in px and confidence logit, both (B, 1, h, w).

        `left` and `right` are (B, 3, h, w) RGB 0..255.
        """
        for step in self._refine(self._start(left, right), iterations):
            last = step
        weights = self._weights(last.state)
        return self._disparity(last, weights), self._confidence(last, weights)

    def _start(self, left: Tensor, right: Tensor) -> _Start:
        left, right = left * (2 / 255) - 1, right * (2 / 255) - 1
        both = torch.cat([left, right])
        if self.config.shared_backbone:
            trunk = self.cnet.trunk(both)
            features = self.conv2(trunk)
            trunk = trunk[: left.shape[0]]
        else:
            trunk = self.cnet.trunk(left)
            features = self.fnet(both)
        levels = self.cnet(trunk, self.config.n_gru_layers)
        states = [torch.tanh(hidden) for hidden, _ in levels]
        context = [
            conv(torch.relu(seen))
            for conv, (_, seen) in zip(self.context_zqr_convs, levels, strict=True)
        ]
        near, far = features[: left.shape[0]], features[left.shape[0] :]
        return _Start(states, context, correlate(near, far))

    def _refine(self, start: _Start, iterations: int) -> Iterator[_Step]:
        pyramid = CorrelationPyramid(start.volume, self.config.corr_levels, self.config.corr_radius)
        states = start.states
        flow = torch.zeros_like(states[0][:, :1])
        column = torch.arange(flow.shape[3], device=flow.device, dtype=flow.dtype)
        for _ in range(iterations):
            flow = flow.detach()
            samples = pyramid.lookup(column + flow)
            both = torch.cat([flow, torch.zeros_like(flow)], dim=1)
            states, change = self.update_block(states, start.context, both, samples)
            flow = flow + change[:, :1]
            yield _Step(flow, states[0])

    def _weights(self, state: Tensor) -> Tensor:
        # In full precision also while training in less: nine weights have to sum to 1.
        logits: Tensor = self.update_block.upsampling_logits(state).float()
        batch, _, height, width = logits.shape
        logits = logits.view(batch, 9, self.config.factor**2, height, width)
        # Spelled out, since onnxruntime is slow at a softmax over any axis but the last.
        raised = (logits - logits.amax(dim=1, keepdim=True).detach()).exp()
        return raised / raised.sum(dim=1, keepdim=True)

    def _disparity(self, step: _Step, weights: Tensor) -> Tensor:
        return -_upsample(self.config.factor * step.flow, weights, self.config.factor)

    def _confidence(self, step: _Step, weights: Tensor) -> Tensor:
        if self.confidence_head is None:
            sure = torch.full_like(step.flow, SURELY_MATCHED)
            return nnf.interpolate(sure, scale_factor=float(self.config.factor))
        return _upsample(self.confidence_head(step.state), weights, self.config.factor)


def _upsample(coarse: Tensor, weights: Tensor, factor: int) -> Tensor:
    """Each fine pixel as a convex combination of the nine cells around it."""
    height, width = coarse.shape[2:]
    padded = nnf.pad(coarse, (1, 1, 1, 1))
    around = [
        padded[:, :, row : row + height, column : column + width]
        for row in range(3)
        for column in range(3)
    ]
    cells = torch.cat(around, dim=1).unsqueeze(2)
    return nnf.pixel_shuffle((weights * cells).sum(dim=1), factor)
