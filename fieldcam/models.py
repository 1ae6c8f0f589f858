"""The two networks' files: where they are, what their manifest says, whether they are intact.

The shipped files lie inside the package. `models add` puts a user's own files
into DATA/models, and those come before the shipped ones.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from hashlib import file_digest
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fieldcam.disk.durable import write_durably
from fieldcam.errors import BadInput, ModelMissing

MANIFEST_NAME = "manifest.json"
MANIFEST_SCHEMA = 1
SHIPPED_FOLDER = Path(__file__).parent / "models_onnx"
SHIPPED_NETWORKS = (
    "The shipped networks learnt from photographs by day; masks and flash light were rendered."
)
OWN_NETWORKS = "Sizes come from networks that were added by the user."


class NetworkRole(StrEnum):
    """What a network is for."""

    SEGMENTATION = "segmentation"
    STEREO = "stereo"


class Origin(StrEnum):
    """Who put a network's file where it is."""

    SHIPPED = "shipped"
    USER = "user"


@dataclass(frozen=True, slots=True)
class ModelFile:
    """One network's entry in a manifest."""

    role: NetworkRole
    path: Path
    sha256: str
    """Of the file's bytes, in lower-case hexadecimal."""
    origin: Origin
    facts: Mapping[str, Any]
    """The whole manifest entry: recipe, seeds, data and measured quality included."""


@dataclass(frozen=True, slots=True)
class SegmentationModel(ModelFile):
    """A Mask R-CNN graph."""

    score_threshold: float
    """Instances that score less are not reported."""


@dataclass(frozen=True, slots=True)
class StereoModel(ModelFile):
    """A RAFT-Stereo graph for one crop of the pair."""

    search_px: float
    """The residual disparity must lie within plus or minus this, in input pixels."""
    multiple: int
    """Height and width of the input must be multiples of this."""
    scale: float
    """Input pixels per image pixel that the network was trained for."""


@dataclass(frozen=True, slots=True)
class Models:
    """The networks of one installation."""

    segmentation: SegmentationModel
    stereo: StereoModel

    @property
    def files(self) -> tuple[SegmentationModel, StereoModel]:
        return self.segmentation, self.stereo

    @property
    def hashes(self) -> dict[str, str]:
        """SHA-256 by role, as readings keep it."""
        return {str(model.role): model.sha256 for model in self.files}

    @property
    def honesty(self) -> str:
        """The sentence that every screen and report shows about these networks."""
        shipped = any(model.origin is Origin.SHIPPED for model in self.files)
        return SHIPPED_NETWORKS if shipped else OWN_NETWORKS


def models_folder(data: Path) -> Path:
    """Where `models add` puts a user's own networks."""
    return data / "models"


def find_models(data: Path | None = None, shipped: Path = SHIPPED_FOLDER) -> Models:
    """The networks to use: the user's own under `data`, else the shipped ones."""
    entries: dict[NetworkRole, ModelFile] = {}
    if data is not None and (models_folder(data) / MANIFEST_NAME).exists():
        entries = _entries(models_folder(data), Origin.USER)
    if len(entries) < len(NetworkRole):
        entries = _entries(shipped, Origin.SHIPPED) | entries
    for role in NetworkRole:
        if role not in entries:
            raise ModelMissing(
                f"No {role} network is installed.", "Reinstall fieldcam, or use `models add`."
            )
    return Models(
        _segmentation(entries[NetworkRole.SEGMENTATION]),
        _stereo(entries[NetworkRole.STEREO]),
    )


def verify_model(model: ModelFile) -> None:
    """Raise ModelMissing unless the file is the one that the manifest names."""
    if _sha256(model.path) != model.sha256:
        raise ModelMissing(
            f"{model.path} is not the {model.role} network that its manifest names "
            f"(its SHA-256 differs).",
            "Reinstall fieldcam, or add the file again with `fieldcam models add`.",
        )


def add_model(
    role: NetworkRole, source: Path, data: Path, shipped: Path = SHIPPED_FOLDER
) -> SegmentationModel | StereoModel:
    """Copy a user's network into DATA/models, where it comes before the shipped one.

    What the app must know about it (score_threshold; search_px, multiple, scale)
    is read from `<source>.json` where there is one, as the export tools write it,
    else taken over from the network that it replaces.
    """
    added, content = described(role, source, data, shipped), _read(source)
    folder = models_folder(data)
    write_durably(added.path, content)
    manifest = _manifest(folder) if (folder / MANIFEST_NAME).exists() else {}
    manifest |= {"schema": MANIFEST_SCHEMA, str(role): dict(added.facts)}
    write_durably(folder / MANIFEST_NAME, json.dumps(manifest, indent=2).encode() + b"\n")
    return added


def described(
    role: NetworkRole, source: Path, data: Path, shipped: Path = SHIPPED_FOLDER
) -> SegmentationModel | StereoModel:
    """What `add_model` would make of a file; nothing is written."""
    if not _read(source):
        raise BadInput(f"{source} is empty.", "Give an ONNX file.")
    digest = _sha256(source)
    target = models_folder(data) / f"{role}-{digest[:12]}.onnx"
    facts = _sidecar(source) or _settings_of_replaced(role, data, shipped)
    facts |= {"file": target.name, "sha256": digest, "added_from": source.name}
    model = ModelFile(role, target, digest, Origin.USER, MappingProxyType(facts))
    return _segmentation(model) if role is NetworkRole.SEGMENTATION else _stereo(model)


def _settings_of_replaced(role: NetworkRole, data: Path, shipped: Path) -> dict[str, Any]:
    replaced = find_models(data, shipped)
    if role is NetworkRole.SEGMENTATION:
        return {"score_threshold": replaced.segmentation.score_threshold}
    stereo = replaced.stereo
    return {"search_px": stereo.search_px, "multiple": stereo.multiple, "scale": stereo.scale}


def _sidecar(source: Path) -> dict[str, Any] | None:
    path = source.with_name(source.name + ".json")
    if not path.exists():
        return None
    try:
        facts = json.loads(path.read_bytes())
    except (OSError, ValueError) as error:
        raise BadInput(f"{path} is not readable as JSON: {error}.") from error
    if not isinstance(facts, dict):
        raise BadInput(f"{path} must hold one JSON object.")
    return facts


def _entries(folder: Path, origin: Origin) -> dict[NetworkRole, ModelFile]:
    manifest = _manifest(folder)
    return {
        role: _entry(folder, role, manifest[role], origin)
        for role in NetworkRole
        if role in manifest
    }


def _entry(folder: Path, role: NetworkRole, facts: object, origin: Origin) -> ModelFile:
    if not isinstance(facts, dict):
        raise ModelMissing(f"The manifest in {folder} has no proper entry for {role}.")
    name, digest = facts.get("file"), facts.get("sha256")
    if not isinstance(name, str) or not isinstance(digest, str) or Path(name).name != name:
        raise ModelMissing(f"The manifest in {folder} does not name the {role} file and its hash.")
    return ModelFile(role, folder / name, digest.lower(), origin, MappingProxyType(facts))


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST_NAME
    try:
        manifest = json.loads(path.read_bytes())
    except OSError as error:
        raise ModelMissing(
            f"The networks' manifest {path} cannot be read: {error.strerror}.",
            "Reinstall fieldcam.",
        ) from error
    except ValueError as error:
        raise ModelMissing(
            f"The networks' manifest {path} is damaged: {error}.",
            "Reinstall fieldcam; or, for networks of your own, remove that folder and add them.",
        ) from error
    if not isinstance(manifest, dict) or manifest.get("schema") != MANIFEST_SCHEMA:
        raise ModelMissing(f"The networks' manifest {path} is of a version unknown here.")
    return manifest


def _segmentation(model: ModelFile) -> SegmentationModel:
    return SegmentationModel(
        model.role, model.path, model.sha256, model.origin, model.facts,
        score_threshold=_number(model, "score_threshold"),
    )  # fmt: skip


def _stereo(model: ModelFile) -> StereoModel:
    return StereoModel(
        model.role, model.path, model.sha256, model.origin, model.facts,
        search_px=_number(model, "search_px"),
        multiple=int(_number(model, "multiple")),
        scale=_number(model, "scale"),
    )  # fmt: skip


def _number(model: ModelFile, name: str) -> float:
    value = model.facts.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ModelMissing(f"The manifest says no {name} for the {model.role} network.")
    if value <= 0:
        raise ModelMissing(f"The {model.role} network's {name} must be above zero.")
    return float(value)


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise ModelMissing(
            f"The network's file {path} cannot be read: {error.strerror}.",
            "Reinstall fieldcam, or add the file again with `fieldcam models add`.",
        ) from error


def _read(source: Path) -> bytes:
    try:
        return source.read_bytes()
    except OSError as error:
        raise BadInput(f"{source} cannot be read: {error.strerror}.") from error
