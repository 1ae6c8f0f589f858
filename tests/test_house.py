"""The shape of the code: what is loaded, how much a folder holds, what the picture shows."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "fieldcam"
MAX_MODULES = 25
"""Of one folder."""
APP = (
    "fieldcam.values",
    "fieldcam.errors",
    "fieldcam.models",
    "fieldcam.session.live",
    "fieldcam.session.importing",
    "fieldcam.session.set_up.setting_up",
    "fieldcam.store.captures",
    "fieldcam.store.store",
    "fieldcam.store.recovery.startup",
    "fieldcam.camera.aimed",
    "fieldcam.camera.beside",
    "fieldcam.camera.finding",
    "fieldcam.camera.head.device",
    "fieldcam.camera.port",
    "fieldcam.camera.replay",
    "fieldcam.camera.simulated",
    "fieldcam.camera.usb3vision.devices",
    "fieldcam.camera.usb3vision.pairing",
    "fieldcam.analysis",
    "fieldcam.app.analysis",
    "fieldcam.app.rig",
    "fieldcam.app.headless",
)
"""What the app's own process loads."""
SCREENS = (
    "fieldcam.tui.app",
    "fieldcam.tui.follow_app",
    "fieldcam.app.simulated",
    "fieldcam.app.replayed",
    "fieldcam.app.field",
    "fieldcam.tui.questions.offer",
    "fieldcam.cli.demo",
)
HEAVY = {
    "cv2",
    "onnxruntime",
    "pupil_apriltags",
    "scipy",
    "networkx",
    "textual",
    "embreex",
    "aiohttp",
    "matplotlib",
}


def loaded_by(statement: str) -> set[str]:
    """Top-level modules in a fresh process after this statement."""
    code = f"{statement}\nimport sys\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_the_apps_own_process_loads_no_vision_library() -> None:
    statement = "\n".join(f"import {name}" for name in APP)
    assert not loaded_by(statement) & HEAVY


def test_the_screens_load_no_vision_library() -> None:
    statement = "\n".join(f"import {name}" for name in SCREENS)
    assert loaded_by(statement) & HEAVY == {"textual"}


def test_the_command_line_defers_heavy_imports() -> None:
    parse = "from fieldcam.cli.main import build_parser; build_parser().format_help()"
    assert not loaded_by(parse) & HEAVY


def test_no_folder_holds_more_modules_than_one_can_take_in() -> None:
    counts: dict[Path, int] = defaultdict(int)
    for path in PACKAGE.rglob("*.py"):
        counts[path.parent] += path.name != "__init__.py"
    assert not {path: count for path, count in counts.items() if count > MAX_MODULES}


def test_a_public_class_has_a_name_of_its_own() -> None:
    places: dict[str, list[Path]] = defaultdict(list)
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(path)
    assert not {name: found for name, found in places.items() if len(found) > 1}


def test_the_picture_of_the_rooms_is_that_of_the_contracts() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    (layers,) = (each for each in contracts["contracts"] if each["type"] == "layers")
    page = (ROOT / "docs/architecture.md").read_text()
    drawn = re.search(r"<!-- layers -->\n```text\n(.*?)```", page, re.DOTALL)
    assert drawn is not None
    lines = [re.split(r" {2,}", line)[0] for line in drawn[1].splitlines()]
    assert lines == layers["layers"]


def test_each_file_that_the_picture_names_is_there() -> None:
    page = (ROOT / "docs/architecture.md").read_text() + (ROOT / "docs/developer.md").read_text()
    named = re.findall(r"`([a-z_0-9]+/[a-z_0-9/]+(?:\.py)?)`", page)
    roots = (PACKAGE, ROOT)
    assert not [name for name in named if not any((root / name).exists() for root in roots)]
