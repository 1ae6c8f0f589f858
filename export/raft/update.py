"""The recurrent update: motion features, convolutional GRUs on up to three scales, heads."""

from __future__ import annotations

from collections.abc import Sequence

import torch
import torch.nn.functional as nnf
from torch import Tensor, nn

from export.raft.config import RaftConfig


class ConvGru(nn.Module):
    """A GRU whose gates are 3x3 convolutions, with the context added to each gate."""

    def __init__(self, hidden: int, inputs: int) -> None:
        super().__init__()
        self.hidden = hidden
        self.convz = nn.Conv2d(hidden + inputs, hidden, 3, padding=1)
        self.convr = nn.Conv2d(hidden + inputs, hidden, 3, padding=1)
        self.convq = nn.Conv2d(hidden + inputs, hidden, 3, padding=1)

    def forward(self, state: Tensor, context: Tensor, *inputs: Tensor) -> Tensor:
        """One step; `context` holds the additions to z, r and q in its channels."""
        # The three gates see the same inputs: one wide convolution is faster than three.
        gates = (self.convz, self.convr, self.convq)
        n = self.hidden
        weight = torch.cat([gate.weight[:, n:] for gate in gates])
        bias = torch.cat([gate.bias for gate in gates if gate.bias is not None])
        seen = nnf.conv2d(torch.cat(inputs, dim=1), weight, bias, padding=1) + context
        recurrent = torch.cat([gate.weight[:, :n] for gate in gates[:2]])
        zr = torch.sigmoid(nnf.conv2d(state, recurrent, padding=1) + seen[:, : 2 * n])
        update, reset = zr[:, :n], zr[:, n:]
        recalled = nnf.conv2d(reset * state, self.convq.weight[:, :n], padding=1)
        proposal = torch.tanh(recalled + seen[:, 2 * n :])
        return (1 - update) * state + update * proposal


class MotionEncoder(nn.Module):
    """Turns correlation samples and the current flow into features."""

    def __init__(self, config: RaftConfig) -> None:
        super().__init__()
        hidden = config.motion_hidden_dim
        samples = config.corr_levels * (2 * config.corr_radius + 1)
        self.convc1 = nn.Conv2d(samples, hidden, 1)
        self.convc2 = nn.Conv2d(hidden, hidden, 3, padding=1)
        self.convf1 = nn.Conv2d(2, hidden, 7, padding=3)
        self.convf2 = nn.Conv2d(hidden, hidden, 3, padding=1)
        self.conv = nn.Conv2d(2 * hidden, config.motion_dim - 2, 3, padding=1)

    def forward(self, flow: Tensor, samples: Tensor) -> Tensor:
        """`flow` (B, 2, H, W): the vertical half is always zero in stereo."""
        seen = torch.relu(self.convc2(torch.relu(self.convc1(samples))))
        moved = torch.relu(self.convf2(torch.relu(self.convf1(flow))))
        joined = torch.relu(self.conv(torch.cat([seen, moved], dim=1)))
        return torch.cat([joined, flow], dim=1)


class FlowHead(nn.Module):
    """The change of the flow, from the finest hidden state."""

    def __init__(self, channels: int, hidden: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(channels, hidden, 3, padding=1)
        self.conv2 = nn.Conv2d(hidden, 2, 3, padding=1)

    def forward(self, state: Tensor) -> Tensor:
        out: Tensor = self.conv2(torch.relu(self.conv1(state)))
        return out


def _coarser(x: Tensor) -> Tensor:
    return nnf.avg_pool2d(x, 3, stride=2, padding=1)


def _as_fine_as(x: Tensor, target: Tensor) -> Tensor:
    return nnf.interpolate(x, target.shape[2:], mode="bilinear", align_corners=True)


class UpdateBlock(nn.Module):
    """One refinement of all hidden states, and of the flow."""

    def __init__(self, config: RaftConfig) -> None:
        super().__init__()
        self.config = config
        coarse, middle, fine = config.hidden_dims
        levels = config.n_gru_layers
        self.encoder = MotionEncoder(config)
        self.gru08 = ConvGru(fine, config.motion_dim + middle * (levels > 1))
        self.gru16 = ConvGru(middle, coarse * (levels == 3) + fine)
        self.gru32 = ConvGru(coarse, middle)
        self.flow_head = FlowHead(fine, config.head_dim)
        self.mask = nn.Sequential(
            nn.Conv2d(fine, config.head_dim, 3, padding=1),
            nn.ReLU(inplace=True),
            nn.Conv2d(config.head_dim, config.factor**2 * 9, 1),
        )

    def forward(
        self, states: Sequence[Tensor], context: Sequence[Tensor], flow: Tensor, samples: Tensor
    ) -> tuple[list[Tensor], Tensor]:
        """New hidden states, finest first, and the (B, 2, H, W) change of the flow."""
        states, levels = list(states), self.config.n_gru_layers
        if self.config.slow_fast_gru and levels == 3:
            self._coarsest(states, context)
        if self.config.slow_fast_gru and levels >= 2:
            self._coarse(states, context)
        self._coarse(states, context)
        inputs = [self.encoder(flow, samples)]
        if levels > 1:
            inputs.append(_as_fine_as(states[1], states[0]))
        states[0] = self.gru08(states[0], context[0], *inputs)
        return states, self.flow_head(states[0])

    def _coarse(self, states: list[Tensor], context: Sequence[Tensor]) -> None:
        levels = self.config.n_gru_layers
        if levels == 3:
            self._coarsest(states, context)
        if levels >= 2:
            inputs = [_coarser(states[0])]
            if levels == 3:
                inputs.append(_as_fine_as(states[2], states[1]))
            states[1] = self.gru16(states[1], context[1], *inputs)

    def _coarsest(self, states: list[Tensor], context: Sequence[Tensor]) -> None:
        states[2] = self.gru32(states[2], context[2], _coarser(states[1]))

    def upsampling_logits(self, state: Tensor) -> Tensor:
        """(B, 9 * factor**2, H, W): weights of nine cells for each fine pixel."""
        # The published training balanced gradients by this quarter.
        logits: Tensor = self.mask(state)
        return 0.25 * logits
