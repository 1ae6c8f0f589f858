"""What the documents that commands print with `--json` are made of."""

from __future__ import annotations

from typing import Any

Json = dict[str, Any]
"""A JSON object, in Python's own values."""
