"""A camera as programs print it: again and again, stopped anywhere, or under a name."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from fieldcam.calibration.reading.yaml_entries import Entry
from fieldcam.errors import CalibrationInvalid

SAME_CAMERA = ("header",)
"""Entries of a printed CameraInfo that may change from one print to the next."""


def one_camera(path: Path, mappings: list[dict[str, Entry]]) -> dict[str, Entry]:
    """The first of the prints; raises CalibrationInvalid where another one follows.

    Printed without `-n 1`, the same camera comes again and again, and the last print may
    end in its middle.
    """
    first, *others = (
        {name: entry for name, entry in mapping.items() if name not in SAME_CAMERA}
        for mapping in mappings
    )
    if others and _is_cut(others[-1], first):
        others.pop()
    if any(other != first for other in others):
        raise CalibrationInvalid(
            f"{path} describes several cameras, one behind the other.",
            "Save each eye's into a file of its own, left.yml and right.yml.",
        )
    return mappings[0]


def unwrapped(mapping: Mapping[str, object]) -> Mapping[str, object]:
    """What stands under the only name, such as `camera_info`, beside which there are words only."""
    inner = [entry for entry in mapping.values() if not isinstance(entry, str)]
    if len(inner) == 1 and isinstance(inner[0], dict) and "data" not in inner[0]:
        return inner[0]
    return mapping


def _is_cut(last: Mapping[str, Entry], whole: Mapping[str, Entry]) -> bool:
    """Whether a print is the beginning of another; what its last entry became says little."""
    names = list(whole)[: len(last)]
    same = all(last.get(name) == whole[name] for name in names[:-1])
    if list(last) != names or not same:
        return False
    return len(last) < len(whole) or last == whole or _begins(last[names[-1]], whole[names[-1]])


def _begins(cut: Entry, whole: Entry) -> bool:
    """Whether one may be what was left of the other; a name that was cut became a text."""
    if isinstance(cut, str):
        texts = [whole] if isinstance(whole, str) else list(whole)
        return any(isinstance(text, str) and text.startswith(cut) for text in texts)
    if isinstance(cut, dict) and isinstance(whole, dict):
        return _is_cut(cut, whole)
    return isinstance(whole, list) and cut == whole[: len(cut)]
