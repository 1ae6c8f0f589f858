"""Modules that lie in the folder where a command is started never run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fieldcam.safe_path import PYTHON

ROOT = Path(__file__).resolve().parents[2]
TRAP = "from pathlib import Path\nPath({marker!r}).write_text(__name__)\n"
NAMES = ("pickle", "json", "secrets", "selectors", "signal", "argparse", "struct", "cv2", "numpy")
PICTURES = """
from fieldcam.camera.beside import PictureProcess
from fieldcam.errors import FieldcamError

def prepare():
    return "ready", None

if __name__ == "__main__":
    process = PictureProcess(prepare)
    print(process.about(str))
    process.close()
"""
COMMANDS = {
    "command": ["-m", "fieldcam", "tags-print", "--help"],
    "networks": ["-m", "fieldcam", "models", "list"],
    "pictures": ["pictures.py"],
}


@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
def test_nothing_of_the_folder_runs(tmp_path: Path, command: list[str]) -> None:
    card, marker = tmp_path / "card", tmp_path / "ran"
    card.mkdir()
    for name in NAMES:
        (card / f"{name}.py").write_text(TRAP.format(marker=str(marker)))
    script = tmp_path / "pictures.py"
    script.write_text(PICTURES)
    argv = [str(script) if part == script.name else part for part in command]
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONSAFEPATH"}
    done = subprocess.run(
        [sys.executable, *argv],
        cwd=card,
        env={**kept, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert not marker.exists()


def test_commands_of_children_are_safe() -> None:
    assert PYTHON[1] == "-P"
    package = ROOT / "fieldcam"
    bare = [
        path
        for path in package.rglob("*.py")
        if "sys.executable" in path.read_text() and path.name != "safe_path.py"
    ]
    assert bare == []
