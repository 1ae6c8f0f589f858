"""Feature and context encoders: a shared trunk of residual stages."""

from __future__ import annotations

from torch import Tensor, nn

from export.raft.config import Norm, RaftConfig


def _norm(kind: Norm, channels: int, groups: int) -> nn.Module:
    if kind is Norm.BATCH:
        return nn.BatchNorm2d(channels)
    if kind is Norm.INSTANCE:
        return nn.InstanceNorm2d(channels)
    if kind is Norm.GROUP:
        return nn.GroupNorm(groups, channels)
    return nn.Sequential()


class ResidualBlock(nn.Module):
    """Two 3x3 convolutions beside a shortcut; the shortcut is projected where the shape changes."""

    def __init__(self, channels_in: int, channels: int, norm: Norm, stride: int = 1) -> None:
        super().__init__()
        groups = channels // 8
        self.conv1 = nn.Conv2d(channels_in, channels, 3, stride=stride, padding=1)
        self.conv2 = nn.Conv2d(channels, channels, 3, padding=1)
        self.relu = nn.ReLU(inplace=True)
        self.norm1 = _norm(norm, channels, groups)
        self.norm2 = _norm(norm, channels, groups)
        self.downsample: nn.Module | None = None
        if stride != 1 or channels_in != channels:
            # Public checkpoints hold this norm under both names.
            self.norm3 = _norm(norm, channels, groups)
            project = nn.Conv2d(channels_in, channels, 1, stride=stride)
            self.downsample = nn.Sequential(project, self.norm3)

    def forward(self, x: Tensor) -> Tensor:
        y = self.relu(self.norm1(self.conv1(x)))
        y = self.relu(self.norm2(self.conv2(y)))
        shortcut = x if self.downsample is None else self.downsample(x)
        out: Tensor = self.relu(shortcut + y)
        return out


def _stage(channels_in: int, channels: int, norm: Norm, stride: int) -> nn.Sequential:
    first = ResidualBlock(channels_in, channels, norm, stride)
    return nn.Sequential(first, ResidualBlock(channels, channels, norm))


class Trunk(nn.Module):
    """Stem and three residual stages, down to 1 / 2**n_downsample."""

    def __init__(self, config: RaftConfig, norm: Norm) -> None:
        super().__init__()
        narrow, middle, wide = config.encoder_widths
        stem_stride, second_stride, third_stride = config.strides
        self.conv1 = nn.Conv2d(3, narrow, 7, stride=stem_stride, padding=3)
        self.norm1 = _norm(norm, narrow, 8)
        self.relu1 = nn.ReLU(inplace=True)
        self.layer1 = _stage(narrow, narrow, norm, 1)
        self.layer2 = _stage(narrow, middle, norm, second_stride)
        self.layer3 = _stage(middle, wide, norm, third_stride)

    def trunk(self, images: Tensor) -> Tensor:
        """(N, 3, h, w) in -1..1 to (N, wide, h / factor, w / factor)."""
        x = self.relu1(self.norm1(self.conv1(images)))
        out: Tensor = self.layer3(self.layer2(self.layer1(x)))
        return out


class FeatureEncoder(Trunk):
    """What is correlated between the eyes."""

    def __init__(self, config: RaftConfig) -> None:
        super().__init__(config, Norm.INSTANCE)
        self.conv2 = nn.Conv2d(config.encoder_widths[2], config.feature_dim, 1)
        init_convolutions(self)

    def forward(self, images: Tensor) -> Tensor:
        out: Tensor = self.conv2(self.trunk(images))
        return out


class ContextEncoder(Trunk):
    """Initial hidden state and context of every GRU, from the left eye."""

    def __init__(self, config: RaftConfig) -> None:
        norm, wide = config.context_norm, config.encoder_widths[2]
        super().__init__(config, norm)
        self.layer4 = _stage(wide, wide, norm, 2)
        self.layer5 = _stage(wide, wide, norm, 2)
        coarse, middle, fine = config.hidden_dims
        self.outputs08 = self._heads(wide, fine, norm)
        self.outputs16 = self._heads(wide, middle, norm)
        self.outputs32 = nn.ModuleList(nn.Conv2d(wide, coarse, 3, padding=1) for _ in range(2))
        init_convolutions(self)

    @staticmethod
    def _heads(wide: int, channels: int, norm: Norm) -> nn.ModuleList:
        return nn.ModuleList(
            nn.Sequential(ResidualBlock(wide, wide, norm), nn.Conv2d(wide, channels, 3, padding=1))
            for _ in range(2)
        )

    def forward(self, trunk: Tensor, levels: int) -> list[tuple[Tensor, Tensor]]:
        """(hidden, context) of each level, finest first, before tanh and ReLU."""
        heads = (self.outputs08, self.outputs16, self.outputs32)
        deeper = (self.layer4, self.layer5)
        found = []
        for level in range(levels):
            if level:
                trunk = deeper[level - 1](trunk)
            found.append((heads[level][0](trunk), heads[level][1](trunk)))
        return found


def init_convolutions(module: nn.Module) -> None:
    """He initialisation by fan-out, as published."""
    for part in module.modules():
        if isinstance(part, nn.Conv2d):
            nn.init.kaiming_normal_(part.weight, mode="fan_out", nonlinearity="relu")
