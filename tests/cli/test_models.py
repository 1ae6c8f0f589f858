"""Networks are found, verified and replaced."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from fieldcam.errors import BadInput, ModelMissing
from fieldcam.models import (
    OWN_NETWORKS,
    SHIPPED_NETWORKS,
    NetworkRole,
    Origin,
    add_model,
    find_models,
    verify_model,
)

SEGMENTATION = b"segmentation network"
STEREO = b"stereo network"


def manifest() -> dict[str, Any]:
    return {
        "schema": 1,
        "segmentation": {
            "file": "segmentation.onnx",
            "sha256": sha256(SEGMENTATION).hexdigest(),
            "score_threshold": 0.5,
            "recipe": "two stages",
        },
        "stereo": {
            "file": "stereo.onnx",
            "sha256": sha256(STEREO).hexdigest(),
            "search_px": 32,
            "multiple": 16,
            "scale": 0.5,
        },
    }


def write_manifest(folder: Path, content: object) -> None:
    (folder / "manifest.json").write_text(json.dumps(content))


@pytest.fixture
def shipped(tmp_path: Path) -> Path:
    folder = tmp_path / "shipped"
    folder.mkdir()
    (folder / "segmentation.onnx").write_bytes(SEGMENTATION)
    (folder / "stereo.onnx").write_bytes(STEREO)
    write_manifest(folder, manifest())
    return folder


def test_the_manifest_is_read(shipped: Path) -> None:
    models = find_models(shipped=shipped)
    assert models.segmentation.score_threshold == 0.5
    assert models.segmentation.facts["recipe"] == "two stages"
    assert (models.stereo.search_px, models.stereo.multiple, models.stereo.scale) == (32, 16, 0.5)
    assert models.hashes == {
        "segmentation": sha256(SEGMENTATION).hexdigest(),
        "stereo": sha256(STEREO).hexdigest(),
    }
    assert models.honesty == SHIPPED_NETWORKS
    for model in models.files:
        verify_model(model)


@pytest.mark.parametrize("damage", ["changed", "absent"])
def test_a_file_that_is_not_the_manifests_is_refused(shipped: Path, damage: str) -> None:
    file = shipped / "stereo.onnx"
    if damage == "changed":
        file.write_bytes(STEREO + b"!")
    else:
        file.unlink()
    models = find_models(shipped=shipped)
    verify_model(models.segmentation)
    with pytest.raises(ModelMissing, match=r"stereo\.onnx"):
        verify_model(models.stereo)


@pytest.mark.parametrize(
    ("path", "value", "complaint"),
    [
        (("schema",), 2, "version unknown"),
        (("segmentation",), "a string", "no proper entry"),
        (("stereo", "file"), "../elsewhere.onnx", "does not name"),
        (("stereo", "sha256"), None, "does not name"),
        (("stereo", "search_px"), None, "no search_px"),
        (("stereo", "multiple"), True, "no multiple"),
        (("stereo", "scale"), 0, "above zero"),
        (("segmentation", "score_threshold"), float("nan"), "no score_threshold"),
    ],
)
def test_a_manifest_that_says_too_little_is_refused(
    shipped: Path, path: tuple[str, ...], value: object, complaint: str
) -> None:
    content = manifest()
    place = content
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    write_manifest(shipped, content)
    with pytest.raises(ModelMissing, match=complaint):
        find_models(shipped=shipped)


@pytest.mark.parametrize("text", ["", "{", "[]", "null"])
def test_a_damaged_manifest_is_refused(shipped: Path, text: str) -> None:
    (shipped / "manifest.json").write_text(text)
    with pytest.raises(ModelMissing):
        find_models(shipped=shipped)


def test_an_added_network_comes_before_the_shipped_one(shipped: Path, tmp_path: Path) -> None:
    own, data = tmp_path / "mine.onnx", tmp_path / "data"
    own.write_bytes(b"better weights")
    (tmp_path / "mine.onnx.json").write_text(json.dumps({"score_threshold": 0.7}))
    add_model(NetworkRole.SEGMENTATION, own, data, shipped)
    own.unlink()
    models = find_models(data, shipped)
    assert models.segmentation.origin is Origin.USER
    assert models.segmentation.score_threshold == 0.7
    assert models.segmentation.sha256 == sha256(b"better weights").hexdigest()
    assert models.stereo.origin is Origin.SHIPPED
    assert models.honesty == SHIPPED_NETWORKS
    verify_model(models.segmentation)


def test_an_added_network_without_a_description_takes_over_the_settings(
    shipped: Path, tmp_path: Path
) -> None:
    own, data = tmp_path / "mine.onnx", tmp_path / "data"
    own.write_bytes(b"better weights")
    added = add_model(NetworkRole.STEREO, own, data, shipped)
    assert added == find_models(data, shipped).stereo
    assert find_models(data, shipped).stereo.search_px == 32


def test_two_added_networks_need_no_shipped_ones(shipped: Path, tmp_path: Path) -> None:
    own, data = tmp_path / "mine.onnx", tmp_path / "data"
    own.write_bytes(b"better weights")
    for role in NetworkRole:
        add_model(role, own, data, shipped)
    models = find_models(data, tmp_path / "nowhere")
    assert models.honesty == OWN_NETWORKS


@pytest.mark.parametrize("content", [None, b""])
def test_adding_nothing_is_refused(shipped: Path, tmp_path: Path, content: bytes | None) -> None:
    own, data = tmp_path / "mine.onnx", tmp_path / "data"
    if content is not None:
        own.write_bytes(content)
    with pytest.raises(BadInput):
        add_model(NetworkRole.STEREO, own, data, shipped)
    assert not data.exists()


def test_a_description_without_the_settings_is_refused(shipped: Path, tmp_path: Path) -> None:
    own, data = tmp_path / "mine.onnx", tmp_path / "data"
    own.write_bytes(b"better weights")
    (tmp_path / "mine.onnx.json").write_text(json.dumps({"search_px": 20}))
    with pytest.raises(ModelMissing, match="multiple"):
        add_model(NetworkRole.STEREO, own, data, shipped)
    assert not data.exists()
