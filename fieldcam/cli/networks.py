"""Opens what the commands run, once the files' hashes were checked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from fieldcam.errors import ModelMissing
from fieldcam.models import ModelFile, Models, find_models, verify_model
from fieldcam.store.folder import data_path_if_any

if TYPE_CHECKING:
    from fieldcam.values import StereoPair
    from fieldcam.vision.segmentation import Segmenter
    from fieldcam.vision.stereo.matching import StereoMatcher


def checked_models(data: Path | None) -> Models:
    """The networks in use; `data` is what `--data` said."""
    models = find_models(data_path_if_any(data))
    for model in models.files:
        verify_model(model)
    return models


def check_network(model: ModelFile, source: Path) -> None:
    """Raise unless a file alone, without those beside it, is a network that can be used."""
    from fieldcam.cli.self_test import drawn_pair
    from fieldcam.vision.trial import try_network

    with TemporaryDirectory() as folder:
        copy = Path(folder) / source.name
        copyfile(source, copy)
        pair = drawn_pair()
        try:
            try_network(replace(model, path=copy), pair)
        except ModelMissing as error:
            if _works(replace(model, path=source), pair):
                raise ModelMissing(
                    f"{source.name} keeps its weights in other files beside it.",
                    "Export it as one file.",
                ) from error
            raise


def _works(model: ModelFile, pair: StereoPair) -> bool:
    from fieldcam.vision.trial import try_network

    try:
        try_network(model, pair)
    except ModelMissing:
        return False
    return True


def open_segmenter(models: Models) -> Segmenter:
    from fieldcam.vision.segmentation import Segmenter

    model = models.segmentation
    return Segmenter(model.path, model.score_threshold, float(model.facts.get("scale", 1.0)))


def open_raft(models: Models) -> StereoMatcher:
    from fieldcam.vision.stereo.raft import RaftMatcher

    model = models.stereo
    return RaftMatcher.from_file(model.path, model.search_px, model.multiple, model.scale)
