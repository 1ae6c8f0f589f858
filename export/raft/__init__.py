"""RAFT-Stereo (Lipson, Teed, Deng, 3DV 2021), with the published parameter names."""

from __future__ import annotations

from export.raft.config import OFFICIAL, REALTIME, SHIPPED, Norm, RaftConfig
from export.raft.model import RaftStereo, StereoPrediction

__all__ = [
    "OFFICIAL",
    "REALTIME",
    "SHIPPED",
    "Norm",
    "RaftConfig",
    "RaftStereo",
    "StereoPrediction",
]
