"""Writes a Mask R-CNN checkpoint as the ONNX file that the app loads.

    python -m export.export_segmentation CHECKPOINT --out models_onnx [--stock]

The graph takes `image` (3, H, W) RGB 0..255 of any size and gives `boxes`
(N, 4), `scores` (N,), `mask_boxes` (N, 4) and `mask_logits` (N, C, M, M).
Boxes are in pixel-edge coordinates: pixel i covers i to i + 1. `--stock` takes
a state dict of torchvision's `maskrcnn_resnet50_fpn`; its resizing is left out.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import onnx
import onnxruntime
import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torchvision.models.detection import MaskRCNN, maskrcnn_resnet50_fpn
from torchvision.models.detection.image_list import ImageList

from export.drawn_crops import draw_window
from export.mask_rcnn import FruitletMaskRCNN
from export.segmentation_state import load_weights

OPSET = 17
SCORE_THRESHOLD = 0.8
"""On 48 rendered pairs kept for tuning 99 % of the well-visible target fruitlets lie above it."""
OUTPUTS = ("boxes", "scores", "mask_boxes", "mask_logits")
CERTAINTY = ("visible_fractions", "width_sds")
"""What our network gives beside these: (N,) each."""
TRACE_SIZE = (224, 256)
PARITY_SIZES = ((224, 256), (512, 512), (301, 415))
BOX_TOLERANCE_PX = 0.02
LOGIT_TOLERANCE = 0.02

Outputs = tuple[Tensor, ...]


class FruitletGraph(nn.Module):
    """Our network with the graph's inputs and outputs."""

    channels = 2
    outputs = (*OUTPUTS, *CERTAINTY)

    def __init__(self, model: FruitletMaskRCNN) -> None:
        super().__init__()
        self.model = model

    def forward(self, image: Tensor) -> Outputs:
        """Boxes, scores, mask windows, mask logits and certainty of one image."""
        seen = self.model.detect(image)
        certainty = seen.visible_fractions, seen.width_sds
        return seen.boxes, seen.scores, seen.mask_boxes, seen.mask_logits, *certainty


class StockGraph(nn.Module):
    """A torchvision Mask R-CNN without its resizing and without pasting."""

    channels = 1
    outputs = OUTPUTS

    def __init__(self, model: MaskRCNN) -> None:
        super().__init__()
        self.model = model
        model.roi_heads.score_thresh = 0.05
        model.roi_heads.nms_thresh = 0.5
        model.roi_heads.detections_per_img = 100

    def forward(self, image: Tensor) -> Outputs:
        """As for our network, without certainty; the mask windows are the boxes."""
        model = self.model
        height, width = image.shape[-2:]
        pixels = model.transform.normalize(image / 255.0)[None]
        padded = F.pad(pixels, (0, -width % 32, 0, -height % 32))
        size = (height, width)
        features = model.backbone(padded)
        proposals, _ = model.rpn(ImageList(padded, [size]), features)
        boxes, scores, labels = self._boxes(features, proposals, size)
        heads = model.roi_heads
        pooled = heads.mask_roi_pool(features, [boxes], [size])
        logits = heads.mask_predictor(heads.mask_head(pooled))
        of_class = labels[:, None, None, None].expand(-1, 1, *logits.shape[-2:])
        return boxes, scores, boxes, logits.gather(1, of_class)

    def _boxes(
        self, features: dict[str, Tensor], proposals: list[Tensor], size: tuple[int, int]
    ) -> tuple[Tensor, Tensor, Tensor]:
        heads = self.model.roi_heads
        pooled = heads.box_head(heads.box_roi_pool(features, proposals, [size]))
        logits, offsets = heads.box_predictor(pooled)
        boxes, scores, labels = heads.postprocess_detections(logits, offsets, proposals, [size])
        return boxes[0], scores[0], labels[0]


Graph = FruitletGraph | StockGraph


def load_stock(path: Path) -> StockGraph:
    """A state dict of torchvision's `maskrcnn_resnet50_fpn`, any number of classes."""
    weights = torch.load(path, map_location="cpu", weights_only=True)
    weights = weights.get("model", weights)
    classes = len(weights["roi_heads.box_predictor.cls_score.bias"])
    model = maskrcnn_resnet50_fpn(weights=None, weights_backbone=None, num_classes=classes)
    model.load_state_dict(weights)
    return StockGraph(model.eval())


def write_onnx(graph: Graph, path: Path) -> None:
    """Traces the graph and writes it; height, width and detections stay free."""
    graph.eval()
    image = torch.rand(3, *TRACE_SIZE) * 255
    torch.onnx.export(
        graph,
        (image,),
        str(path),
        input_names=["image"],
        output_names=list(graph.outputs),
        dynamic_axes={"image": {1: "height", 2: "width"}, **{n: {0: "n"} for n in graph.outputs}},
        opset_version=OPSET,
        dynamo=False,
    )
    onnx.checker.check_model(str(path))


def open_session(path: Path, threads: int = 2) -> onnxruntime.InferenceSession:
    """A session of the file on the CPU."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def run_session(
    session: onnxruntime.InferenceSession, image: npt.NDArray[np.float32]
) -> list[npt.NDArray[np.float32]]:
    """All outputs of one image (3, H, W), in the graph's order."""
    return [np.asarray(v) for v in session.run(None, {"image": image})]


@torch.no_grad()
def parity(graph: Graph, path: Path, images: Sequence[Tensor]) -> dict[str, float]:
    """Largest differences between PyTorch and onnxruntime over the images."""
    session = open_session(path)
    measures = ("boxes_px", "scores", "boxes_px", "logits", "certainty", "certainty")
    worst = dict.fromkeys(measures[: len(graph.outputs)], 0.0)
    for image in images:
        mine = [v.numpy() for v in graph(image)]
        theirs = run_session(session, image.numpy())
        if mine[0].shape != theirs[0].shape:
            raise ValueError(f"PyTorch found {len(mine[0])} fruitlets, ONNX {len(theirs[0])}")
        for name, one, other in zip(measures, mine, theirs, strict=False):
            if len(one):
                worst[name] = max(worst[name], float(np.abs(one - other).max()))
    return worst


def check_parity(graph: Graph, path: Path, images: Sequence[Tensor]) -> dict[str, float]:
    """The differences, refused where they are more than rounding."""
    worst = parity(graph, path, images)
    if worst["boxes_px"] > BOX_TOLERANCE_PX or worst["logits"] > LOGIT_TOLERANCE:
        raise ValueError(f"the ONNX graph differs from PyTorch: {worst}")
    return worst


def parity_images() -> list[Tensor]:
    """Drawn fruit in pictures of several sizes."""
    images = []
    for seed, (height, width) in enumerate(PARITY_SIZES):
        drawn = draw_window(np.random.default_rng(seed)).image[:height, :width]
        images.append(torch.from_numpy(drawn.transpose(2, 0, 1).astype(np.float32)))
    return images


def manifest_entry(graph: Graph, path: Path, about: dict[str, Any]) -> dict[str, Any]:
    """What the app and its reader want to know about the file."""
    return {
        "file": path.name,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "input": {"name": "image", "layout": "CHW", "colour": "RGB", "range": [0, 255]},
        "box_origin": "pixel edge: pixel i covers i to i + 1",
        "mask_channels": ["visible", "whole"][: graph.channels],
        "score_threshold": SCORE_THRESHOLD,
        **about,
    }


def update_manifest(folder: Path, role: str, entry: dict[str, Any]) -> None:
    """Replaces one role's entry; the others stay."""
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text()) if path.exists() else {"schema": 1}
    manifest[role] = entry
    part = path.with_suffix(".part")
    part.write_text(json.dumps(manifest, indent=2) + "\n")
    part.replace(path)


def main(argv: list[str] | None = None) -> int:
    """Exports, proves parity, writes the file and its manifest entry."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("--out", type=Path, required=True, help="folder of the manifest")
    parser.add_argument("--name", default="segmentation.onnx")
    parser.add_argument("--stock", action="store_true")
    parser.add_argument("--about", type=Path, help="JSON that goes to the manifest entry")
    options = parser.parse_args(argv)
    about: dict[str, Any] = {}
    graph: Graph
    if options.stock:
        graph = load_stock(options.checkpoint)
    else:
        model, about = load_weights(options.checkpoint)
        graph = FruitletGraph(model)
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / options.name
    write_onnx(graph, path)
    worst = check_parity(graph, path, parity_images())
    if options.about:
        about |= json.loads(options.about.read_text("utf-8"))
    update_manifest(options.out, "segmentation", manifest_entry(graph, path, about))
    sys.stderr.write(f"{path}: differs from PyTorch by at most {worst}\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
