"""What other processes of the torture may import: the tests' modules, and the app."""

from __future__ import annotations

import os
from pathlib import Path

_TESTS = Path(__file__).resolve().parents[1]
IMPORTS = {"PYTHONPATH": os.pathsep.join([str(_TESTS), str(_TESTS.parent)])}
