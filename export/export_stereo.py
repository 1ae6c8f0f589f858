"""Turns a stereo checkpoint into the ONNX file that the app loads, and proves parity.

`python -m export.export_stereo CHECKPOINT --out models_onnx` takes a checkpoint of
`export.train_stereo`; `--public default|realtime` takes one that RAFT-Stereo's authors
published.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import torch
from torch import Tensor, nn

from export.raft import OFFICIAL, REALTIME, Norm, RaftConfig, RaftStereo
from export.stereo_data import SEARCH_PX, SHRINK
from export.stereo_state import load_network

OPSET = 17
PARITY_PX = 1e-3
PARITY_SIZES = ((96, 128), (192, 160), (352, 352))
PUBLIC = {"default": OFFICIAL, "realtime": REALTIME}


class ParityError(Exception):
    """The ONNX file does not compute what the network computes."""


@dataclass(frozen=True, slots=True)
class Exported:
    """One ONNX file and how well it agrees with its network."""

    path: Path
    sha256: str
    parity_px: float


class _Inference(nn.Module):
    """The graph's two inputs and outputs, with the number of iterations fixed.

    Its confidence is at least 0 where the network's own is at least `least_confidence`.
    """

    def __init__(self, network: RaftStereo, iterations: int, least_confidence: float = 0.0) -> None:
        super().__init__()
        self.network = network
        self.iterations = iterations
        self.least_confidence = least_confidence

    def forward(self, left: Tensor, right: Tensor) -> tuple[Tensor, Tensor]:
        disparity, confidence = self.network.predict(left, right, self.iterations)
        return disparity, confidence - self.least_confidence


def load_public(path: Path, config: RaftConfig) -> RaftStereo:
    """A published checkpoint, which holds the names of a DataParallel network."""
    saved: Mapping[str, Tensor] = torch.load(path, map_location="cpu", weights_only=True)
    network = RaftStereo(config)
    network.load_state_dict({name.removeprefix("module."): v for name, v in saved.items()})
    return network.eval()


def multiple_of(config: RaftConfig) -> int:
    """Heights and widths of the input must be multiples of this, as the authors pad too."""
    return max(16, int(config.factor * 2 ** (config.n_gru_layers - 1)) * 2)


def export_onnx(
    network: RaftStereo, iterations: int, path: Path, least_confidence: float = 0.0
) -> Exported:
    """Writes `path` and compares it with the network on several sizes.

    Raises:
        ParityError: the two differ by PARITY_PX or more.
    """
    graph = _Inference(network, iterations, least_confidence).eval()
    names = ("left", "right", "disparity", "confidence")
    torch.onnx.export(
        graph,
        _random_pair(*PARITY_SIZES[0]),
        str(path),
        dynamo=False,
        opset_version=OPSET,
        input_names=list(names[:2]),
        output_names=list(names[2:]),
        dynamic_axes={name: {2: "h", 3: "w"} for name in names},
    )
    parity = max(parity_px(graph, path, size) for size in PARITY_SIZES)
    if not parity < PARITY_PX:
        raise ParityError(f"{path.name} differs by {parity:.2g} px from its network.")
    return Exported(path, hashlib.sha256(path.read_bytes()).hexdigest(), parity)


def parity_px(graph: nn.Module, path: Path, size: tuple[int, int]) -> float:
    """Largest difference of disparity or confidence between the file and the network."""
    left, right = _random_pair(*size)
    with torch.no_grad():
        expected = graph(left, right)
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    found = session.run(None, {"left": left.numpy(), "right": right.numpy()})
    return max(float(np.abs(a - b.numpy()).max()) for a, b in zip(found, expected, strict=True))


def _random_pair(height: int, width: int) -> tuple[Tensor, Tensor]:
    """A smooth random picture and the same moved by 5 px."""
    generator = torch.Generator().manual_seed(height + width)
    coarse = torch.rand((1, 3, height // 8, width // 8), generator=generator)
    left = 255 * nn.functional.interpolate(coarse, (height, width), mode="bicubic").clamp(0, 1)
    return left, torch.roll(left, -5, dims=3)


def write_manifest(folder: Path, entry: Mapping[str, Any]) -> None:
    """Puts `entry` under "stereo" in the manifest and leaves the rest as it is."""
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text("utf-8")) if path.exists() else {"schema": 1}
    manifest["stereo"] = dict(entry)
    partial = path.with_suffix(".partial")
    partial.write_text(json.dumps(manifest, indent=2) + "\n", "utf-8")
    partial.replace(path)


def manifest_entry(
    exported: Exported, config: RaftConfig, iterations: int, about: Mapping[str, Any]
) -> dict[str, Any]:
    """What the app and a reader of the manifest need to know of one file."""
    return {
        "file": exported.path.name,
        "sha256": exported.sha256,
        "input": {"names": ["left", "right"], "layout": "1,3,h,w", "range": "RGB 0..255"},
        "search_px": SEARCH_PX,
        "multiple": multiple_of(config),
        "scale": 1 / SHRINK,
        "has_confidence": config.confidence,
        "iterations": iterations,
        "architecture": config.as_dict(),
        "parity_px": exported.parity_px,
        **about,
    }


def main(arguments: list[str] | None = None) -> None:
    """Writes the file and its manifest entry, and prints the entry."""
    options = _parser().parse_args(arguments)
    about: dict[str, Any] = {}
    if options.public is None:
        network, about = load_network(options.checkpoint)
    else:
        config = replace(PUBLIC[options.public], context_norm=Norm(options.context_norm))
        network = load_public(options.checkpoint, config)
    options.out.mkdir(parents=True, exist_ok=True)
    least = options.least_confidence
    exported = export_onnx(network, options.iterations, options.out / options.name, least)
    about["least_confidence"] = least
    if options.about:
        about |= json.loads(options.about.read_text("utf-8"))
    entry = manifest_entry(exported, network.config, options.iterations, about)
    write_manifest(options.out, entry)
    sys.stdout.write(json.dumps(entry, indent=2) + "\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("--out", type=Path, default=Path("models_onnx"))
    parser.add_argument("--name", default="stereo.onnx")
    parser.add_argument("--iterations", type=int, default=6)
    parser.add_argument("--least-confidence", type=float, default=0.0,
                        help="logit of the network from which an estimate counts")  # fmt: skip
    parser.add_argument("--public", choices=sorted(PUBLIC), default=None)
    parser.add_argument("--context-norm", choices=[str(n) for n in Norm], default="batch")
    parser.add_argument("--about", type=Path, help="JSON with recipe, data and measured quality")
    return parser


if __name__ == "__main__":
    main()
