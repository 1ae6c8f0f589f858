"""The sizes that distinguish one RAFT-Stereo from another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any


class Norm(StrEnum):
    """How an encoder normalises its activations."""

    BATCH = "batch"
    INSTANCE = "instance"
    GROUP = "group"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class RaftConfig:
    """Architecture of one network; the defaults are the published ones."""

    n_downsample: int = 2
    """Disparity is refined at 1 / 2**n_downsample of the input."""
    n_gru_layers: int = 3
    hidden_dims: tuple[int, int, int] = (128, 128, 128)
    """Hidden state of the coarsest, the middle and the finest GRU."""
    corr_levels: int = 4
    corr_radius: int = 4
    shared_backbone: bool = False
    context_norm: Norm = Norm.BATCH
    slow_fast_gru: bool = False
    """Whether the coarse GRUs run several times in one iteration."""
    encoder_widths: tuple[int, int, int] = (64, 96, 128)
    """Channels of stem and first stage, of the second, of the third and later stages."""
    feature_dim: int = 256
    """Channels that are correlated."""
    motion_dim: int = 128
    motion_hidden_dim: int = 64
    head_dim: int = 256
    """Hidden channels of the heads for the update and for the upsampling weights."""
    early_stride: bool = False
    """Whether the stem shrinks first; the published encoders shrink in their last stages."""
    confidence: bool = False
    """Whether there is a head for the logit that a pixel is matched (not published)."""

    @property
    def factor(self) -> int:
        """Input pixels in one cell of the finest GRU."""
        return int(2**self.n_downsample)

    @property
    def strides(self) -> tuple[int, int, int]:
        """Strides of the stem, of the second and of the third stage."""
        n = self.n_downsample
        late = (1 + (n > 2), 1 + (n > 1), 1 + (n > 0))
        return (late[2], late[1], late[0]) if self.early_stride else late

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for a checkpoint or a manifest."""
        return asdict(self) | {"context_norm": str(self.context_norm)}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> RaftConfig:
        """The inverse of `as_dict`, from JSON too."""
        plain = dict(values)
        for name in ("hidden_dims", "encoder_widths"):
            plain[name] = tuple(plain[name])
        plain["context_norm"] = Norm(plain["context_norm"])
        return cls(**plain)


OFFICIAL = RaftConfig()
REALTIME = RaftConfig(n_downsample=3, n_gru_layers=2, shared_backbone=True, slow_fast_gru=True)
SHIPPED = RaftConfig(
    n_gru_layers=2,
    hidden_dims=(32, 32, 32),
    corr_levels=3,
    shared_backbone=True,
    encoder_widths=(24, 32, 48),
    feature_dim=64,
    motion_dim=32,
    motion_hidden_dim=32,
    head_dim=48,
    early_stride=True,
    confidence=True,
)
"""Small enough for two laptop cores at 352x352."""
