"""Programs on a small file system that only they see."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from torture.paths import IMPORTS

_NAMESPACE = ["unshare", "--user", "--map-root-user", "--mount"]


def why_not(folder: Path) -> str:
    """Why no small disk can be mounted there; empty where it can."""
    if shutil.which("unshare") is None:
        return "unshare is not installed"
    tried = subprocess.run(
        [*_NAMESPACE, "sh", "-c", _mount(folder, "1m")], capture_output=True, check=False
    )
    return "this kernel gives no user namespace to mount it in" if tried.returncode else ""


def on_a_small_disk(folder: Path, size: str, *steps: str) -> dict[str, Any]:
    """What the last of these shell steps printed as JSON."""
    return outcome([*_NAMESPACE, "sh", "-ec", "\n".join((_mount(folder, size), *steps))])


def outcome(command: list[str]) -> dict[str, Any]:
    """What a program that may import from the tests printed as JSON."""
    environment = os.environ | IMPORTS
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def _mount(folder: Path, size: str) -> str:
    return f"mount -t tmpfs -o size={size} tmpfs {folder}"
