"""What is installed holds what it needs."""

from __future__ import annotations

import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from fieldcam.cli.cameras.commands import RULE
from fieldcam.cli.main import main
from fieldcam.models import SHIPPED_FOLDER, find_models, verify_model

PAGES = ("phone.html", "phone.js", "code.html")
ROOT = Path(__file__).resolve().parents[1]


def test_the_shipped_networks_are_intact() -> None:
    models = find_models()
    for model in models.files:
        verify_model(model)


def test_the_models_are_a_link_so_that_every_kind_of_install_finds_them() -> None:
    assert (ROOT / "fieldcam/models_onnx").is_symlink()
    assert SHIPPED_FOLDER.resolve() == ROOT / "models_onnx"


def test_the_udev_rule_lies_in_the_package_and_is_printed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rule = ROOT / "systemd/60-fieldcam-camera.rules"
    assert RULE.resolve() == rule
    assert main(["camera", "rule"]) == 0
    assert capsys.readouterr().out == rule.read_text()


def test_constraints_hold_no_address_and_nothing_of_the_export_extra() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    assert all("==" in line and "/" not in line and not line.startswith("-") for line in lines)
    assert not [line for line in lines if line.startswith(("torch", "nvidia", "triton"))]


def test_every_dependency_has_its_reason() -> None:
    text = (ROOT / "pyproject.toml").read_text()
    for dependency in tomllib.loads(text)["project"]["dependencies"]:
        line = next(line for line in text.splitlines() if f'"{dependency}"' in line)
        assert "# " in line, dependency


@pytest.mark.slow
def test_the_wheel_carries_the_networks_and_the_type_marker(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(tmp_path)]
    subprocess.run([*command, str(ROOT)], check=True)
    (wheel,) = tmp_path.glob("fieldcam-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    shipped = {f"fieldcam/models_onnx/{path.name}" for path in (ROOT / "models_onnx").iterdir()}
    assert shipped <= set(names)
    assert "fieldcam/py.typed" in names
    assert "fieldcam/systemd/60-fieldcam-camera.rules" in names
    assert {f"fieldcam/serving/pages/{name}" for name in PAGES} <= set(names)
    assert not [name for name in names if name.startswith(("tests", "export"))]
