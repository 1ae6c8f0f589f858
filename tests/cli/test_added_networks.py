"""A network that would stop sizing is refused before it takes the place of a good one."""

from __future__ import annotations

from pathlib import Path

import pytest

from fieldcam.cli.main import main
from fieldcam.errors import ExitCode
from fieldcam.models import find_models

Capture = pytest.CaptureFixture[str]
GOLDEN = Path(__file__).parents[1] / "golden"


def refused(capsys: Capture, data: Path, role: str, file: Path) -> str:
    assert main(["--data", str(data), "models", "add", role, str(file)]) == ExitCode.BAD_INPUT
    assert not data.exists()
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    return said


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("nan_segmentation.onnx", "its boxes are not all numbers"),
        ("wrong_shape_segmentation.onnx", "its boxes have the shape 3, not 3 x 4"),
    ],
)
def test_what_it_gives_must_be_what_sizing_works_on(
    capsys: Capture, tmp_path: Path, name: str, sentence: str
) -> None:
    assert sentence in refused(capsys, tmp_path / "data", "segmentation", GOLDEN / name)


@pytest.mark.export
@pytest.mark.parametrize("role", ["segmentation", "stereo"])
def test_weights_beside_the_file_are_told(capsys: Capture, tmp_path: Path, role: str) -> None:
    onnx = pytest.importorskip("onnx")
    shipped = {str(model.role): model.path for model in find_models().files}[role]
    file = tmp_path / "mine.onnx"
    onnx.save(
        onnx.load(shipped), file, save_as_external_data=True, location="mine.data", size_threshold=0
    )
    assert (tmp_path / "mine.data").exists()
    assert "weights in other files beside it" in refused(capsys, tmp_path / "data", role, file)


@pytest.mark.export
def test_a_network_for_one_size_is_told(capsys: Capture, tmp_path: Path) -> None:
    onnx = pytest.importorskip("onnx")
    model = onnx.load(find_models().segmentation.path)
    _, height, width = model.graph.input[0].type.tensor_type.shape.dim
    height.dim_value, width.dim_value = 540, 720
    file = tmp_path / "mine.onnx"
    onnx.save(model, file)
    assert "picture of this size" in refused(capsys, tmp_path / "data", "segmentation", file)
