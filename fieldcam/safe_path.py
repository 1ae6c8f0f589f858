"""Keeps Python from running modules that lie in the folder where fieldcam was started.

A card or a download may hold a `pickle.py` or `json.py`, which would stand in for Python's
own wherever the working folder comes first on the path.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

PYTHON = (sys.executable, "-P")
"""Begins every command that runs Python."""
_FOR_CHILDREN = "PYTHONSAFEPATH"


def keep_children_safe() -> None:
    """Python processes that libraries start, as for multiprocessing, inherit this."""
    os.environ[_FOR_CHILDREN] = "1"


def leave_working_folder() -> None:
    """Take the folder that `python -m` puts first off the path, unless fieldcam lies in it."""
    own = Path(__file__).resolve().parents[1]
    if not sys.flags.safe_path and sys.path and Path(sys.path[0] or ".").resolve() != own:
        del sys.path[0]
