"""The wheel with its own dependencies and nothing else: no simulator, no reports, no tests."""

from __future__ import annotations

import json
import subprocess
import sys
import venv
from pathlib import Path

import cv2
import numpy as np
import pytest
from drawn_tags import tag_cells

ROOT = Path(__file__).resolve().parents[1]
CELL_PX = 20

pytestmark = pytest.mark.runtime


@pytest.fixture(scope="module")
def fieldcam(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The command, in an environment of its own."""
    folder = tmp_path_factory.mktemp("alone")
    wheels = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(folder)]
    subprocess.run([*wheels, str(ROOT)], check=True)
    (wheel,) = folder.glob("fieldcam-*.whl")
    venv.create(folder / "venv", with_pip=True)
    pip = [str(folder / "venv/bin/python"), "-m", "pip", "install", "--quiet"]
    subprocess.run([*pip, "-c", str(ROOT / "constraints.txt"), str(wheel)], check=True)
    return folder / "venv/bin/fieldcam"


def run(fieldcam: Path, *arguments: str, data: Path) -> subprocess.CompletedProcess[str]:
    command = [str(fieldcam), "--data", str(data), *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=data)


def test_a_tag_is_read_and_the_networks_run(fieldcam: Path, tmp_path: Path) -> None:
    cell = np.ones((CELL_PX, CELL_PX), np.uint8)
    card = np.pad(np.kron(tag_cells(17), cell), 200, constant_values=255)
    image = tmp_path / "card.png"
    cv2.imwrite(str(image), card)
    (tag,) = json.loads(run(fieldcam, "tags", str(image), "--json", data=tmp_path).stdout)["tags"]
    assert tag["id"] == 17
    found = run(fieldcam, "segment", str(image), "--json", data=tmp_path)
    assert json.loads(found.stdout) == {"instances": []}
    assert run(fieldcam, "models", "verify", data=tmp_path).returncode == 0


@pytest.mark.parametrize(
    ("command", "extra"),
    [(["demo", "--headless", "--clusters", "1"], "simulator"), (["serve"], "serve")],
)
def test_what_needs_an_extra_names_it(
    fieldcam: Path, tmp_path: Path, command: list[str], extra: str
) -> None:
    told = run(fieldcam, *command, data=tmp_path)
    assert told.returncode == 2
    assert f"fieldcam[{extra}]" in told.stderr
    assert "Traceback" not in told.stderr
