"""Who may import whom; read from the source, and from what a fresh process really loads."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "fieldcam"
OWNERS = {
    "textual": ("tui",),
    "textual_serve": ("serving",),
    "aiohttp": ("serving",),
    "usb": ("camera/usb3vision",),
    "onnxruntime": ("vision",),
    "pupil_apriltags": ("vision",),
    "embreex": ("simulator",),
    "matplotlib": ("report",),
    "torch": (),
    "torchvision": (),
    "export": (),
}
"""Each library and the parts of fieldcam that may import it."""
PURE = ("vision", "growth", "calibration")
"""Parts that know no database, screen or session."""
GROUND = ("disk", "codec", "calibration")
"""Parts on which all others may stand."""
BELOW_GROUND = ("values", "errors", "foreign")
NEVER = {
    "store": ("exchange", "vision", "session"),
    "exchange": ("store", "analysis", "session"),
    "camera": ("store", "analysis", "session", "vision"),
}
NOT_FOR_PURE = ("store", "session", "tui", "cli", "camera", "analysis", "sync", "report")
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
HEAVY = (
    "cv2",
    "onnxruntime",
    "pupil_apriltags",
    "scipy",
    "networkx",
    "textual",
    "embreex",
    "aiohttp",
    "matplotlib",
)


def sources() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def imported(path: Path) -> Iterator[str]:
    """Full names of all modules that a file imports, anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            assert node.level == 0, f"{path}: relative import"
            yield node.module
            yield from (f"{node.module}.{name.name}" for name in node.names)


def part(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


@pytest.mark.parametrize("path", sources(), ids=part)
def test_libraries_stay_with_their_owners(path: Path) -> None:
    for name in imported(path):
        owners = OWNERS.get(name.split(".")[0])
        if owners is not None:
            assert part(path).startswith(tuple(f"{owner}/" for owner in owners)), name


def test_values_and_errors_import_nothing_of_ours() -> None:
    for name in ("values.py", "errors.py"):
        assert not [n for n in imported(PACKAGE / name) if n.startswith("fieldcam")]


def test_pure_parts_know_no_database_screen_or_session() -> None:
    forbidden = tuple(f"fieldcam.{name}" for name in NOT_FOR_PURE)
    for path in sources():
        if part(path).startswith(tuple(f"{name}/" for name in PURE)):
            assert not [n for n in imported(path) if n.startswith(forbidden)], part(path)


@pytest.mark.parametrize("room", GROUND)
def test_the_ground_floor_stands_on_no_other_room(room: str) -> None:
    own = tuple(f"fieldcam.{name}" for name in (room, *BELOW_GROUND))
    for path in (PACKAGE / room).rglob("*.py"):
        ours = [name for name in imported(path) if name.startswith("fieldcam.")]
        assert all(name.startswith(own) for name in ours), part(path)


@pytest.mark.parametrize(("room", "others"), NEVER.items())
def test_no_room_reaches_up(room: str, others: tuple[str, ...]) -> None:
    forbidden = tuple(f"fieldcam.{name}." for name in others)
    for path in (PACKAGE / room).rglob("*.py"):
        assert not [name for name in imported(path) if name.startswith(forbidden)], part(path)


def test_screens_know_no_camera_nor_what_chose_it() -> None:
    """Of the analysis they show its status."""
    others = tuple(f"fieldcam.{name}" for name in ("camera", "simulator", "vision", "app", "cli"))
    for path in sources():
        if part(path).startswith("tui/"):
            names = [*imported(path)]
            assert not [name for name in names if name.startswith(others)], part(path)
            of_analysis = [name for name in names if name.startswith("fieldcam.analysis")]
            assert all(name.startswith("fieldcam.analysis.status") for name in of_analysis)


def test_only_commands_and_what_they_compose_know_the_screens() -> None:
    composing = ("app/", "cli/", "tui/")
    for path in sources():
        if not part(path).startswith(composing):
            names = [*imported(path)]
            assert not [n for n in names if n.startswith(("fieldcam.app", "fieldcam.tui"))], path


def test_no_folder_holds_more_modules_than_one_can_take_in() -> None:
    folders = [PACKAGE / "app", PACKAGE / "tui", *(p for p in PACKAGE.glob("tui/*") if p.is_dir())]
    assert all(len([*folder.glob("*.py")]) <= 25 for folder in folders)


def test_the_node_map_is_neutral_to_the_transport() -> None:
    own = ("fieldcam.camera.genapi", "fieldcam.errors", "fieldcam.values", "fieldcam.foreign")
    for path in sources():
        if part(path).startswith("camera/genapi/"):
            assert not [
                n for n in imported(path) if n.startswith("fieldcam") and not n.startswith(own)
            ]
            assert {n.split(".")[0] for n in imported(path)} <= {
                "fieldcam",
                *sys.stdlib_module_names,
            }


def loaded_by(statement: str) -> set[str]:
    """Top-level modules in a fresh process after this statement."""
    code = f"{statement}\nimport sys\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_the_apps_own_process_loads_no_vision_library() -> None:
    statement = "\n".join(f"import {name}" for name in APP)
    assert not loaded_by(statement) & set(HEAVY)


def test_the_screens_load_no_vision_library() -> None:
    statement = "\n".join(f"import {name}" for name in SCREENS)
    assert loaded_by(statement) & set(HEAVY) == {"textual"}


def test_the_command_line_defers_heavy_imports() -> None:
    parse = "from fieldcam.cli.main import build_parser; build_parser().format_help()"
    assert not loaded_by(parse) & set(HEAVY)
