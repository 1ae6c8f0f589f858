"""A network is run once before it is taken: what it gives must be what sizing works on."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from fieldcam.errors import ModelMissing
from fieldcam.models import ModelFile, NetworkRole, StereoModel
from fieldcam.values import ImageU8, StereoPair
from fieldcam.vision import segmentation
from fieldcam.vision.onnx_session import OnnxModel, network_image
from fieldcam.vision.stereo import raft

ANY = None
"""A length that the network chooses."""
_Shape = tuple[int | None, ...]


def try_network(model: ModelFile, pair: StereoPair) -> None:
    """Raise ModelMissing unless the network works on two cut-outs of a pair.

    Two, since a network that was exported for one size takes no other.
    """
    height, width = pair.left.shape[:2]
    for rows, columns in ((height // 2, width // 2), (height // 3, width // 2 - 37)):
        _try(model, pair.left[:rows, :columns], pair.right[:rows, :columns])


def _try(model: ModelFile, left: ImageU8, right: ImageU8) -> None:
    if model.role is NetworkRole.SEGMENTATION:
        _try_segmentation(model, left)
    elif isinstance(model, StereoModel):
        _try_stereo(model, left, right)


def _try_segmentation(model: ModelFile, image: ImageU8) -> None:
    network = OnnxModel(model.path, segmentation.SIGNATURE)
    output = network.run({"image": network_image(image)})
    found = len(output["boxes"]) if output["boxes"].ndim else 0
    _check(
        model,
        output,
        {
            "boxes": (found, 4),
            "scores": (found,),
            "mask_boxes": (found, 4),
            "mask_logits": (found, ANY, ANY, ANY),
        },
    )
    scores = output["scores"]
    if found and not (scores.min() >= 0 and scores.max() <= 1):
        raise _refused(model, f"its scores reach from {scores.min():g} to {scores.max():g}")
    channels, *cells = output["mask_logits"].shape[1:]
    if channels < 1 or min(cells) < 2:
        raise _refused(model, f"its masks have {channels} channels of {cells} cells")


def _try_stereo(model: StereoModel, left: ImageU8, right: ImageU8) -> None:
    network = OnnxModel(model.path, raft.SIGNATURE)
    rows, columns = (side // model.multiple * model.multiple for side in left.shape[:2])
    eyes = {"left": left, "right": right}
    inputs = {name: network_image(eye[:rows, :columns])[None] for name, eye in eyes.items()}
    output = network.run(inputs)
    _check(model, output, dict.fromkeys(("disparity", "confidence"), (1, 1, rows, columns)))


def _check(
    model: ModelFile, output: Mapping[str, npt.NDArray[np.generic]], shapes: Mapping[str, _Shape]
) -> None:
    for name, wanted in shapes.items():
        values = output[name]
        fits = len(values.shape) == len(wanted) and all(
            each in (ANY, side) for each, side in zip(wanted, values.shape, strict=True)
        )
        if not fits:
            due = " x ".join("any" if each is ANY else str(each) for each in wanted)
            given = " x ".join(map(str, values.shape)) or "a single number"
            raise _refused(model, f"its {name} have the shape {given}, not {due}")
        if not np.isfinite(values).all():
            raise _refused(model, f"its {name} are not all numbers")


def _refused(model: ModelFile, what: str) -> ModelMissing:
    return ModelMissing(
        f"{model.path.name} was run on a drawn picture, and cannot be used: {what}.",
        "Export it again; the network that was in use stays.",
    )
