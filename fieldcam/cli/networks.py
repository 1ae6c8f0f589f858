"""Opens what the commands run, once the files' hashes were checked."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.models import Models, Role, find_models, verify_model
from fieldcam.store.folder import data_path_if_any

if TYPE_CHECKING:
    from fieldcam.vision.segmentation import Segmenter
    from fieldcam.vision.stereo import StereoMatcher


def checked_models(data: Path | None) -> Models:
    """The networks in use; `data` is what `--data` said."""
    models = find_models(data_path_if_any(data))
    for model in models.files:
        verify_model(model)
    return models


def check_network(role: Role, path: Path) -> None:
    """Raise unless the file is a network that can take this role."""
    from fieldcam.vision import raft, segmentation
    from fieldcam.vision.onnx_session import OnnxModel

    if not path.is_file() or path.stat().st_size == 0:
        return  # `add_model` says what is wrong with it
    signature = segmentation.SIGNATURE if role is Role.SEGMENTATION else raft.SIGNATURE
    OnnxModel(path, signature).warm_up()


def open_segmenter(models: Models) -> Segmenter:
    from fieldcam.vision.segmentation import Segmenter

    model = models.segmentation
    return Segmenter(model.path, model.score_threshold, float(model.facts.get("scale", 1.0)))


def open_raft(models: Models) -> StereoMatcher:
    from fieldcam.vision.raft import RaftMatcher

    model = models.stereo
    return RaftMatcher.from_file(model.path, model.search_px, model.multiple, model.scale)
