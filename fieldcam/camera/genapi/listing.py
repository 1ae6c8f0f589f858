"""A camera's features as plain values, in the order of its feature file, for lists and reports.

None stands where nobody can tell; what is wrong with one feature is told in its place,
so that the others are seen.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from fieldcam.camera.genapi.access import Visibility
from fieldcam.camera.genapi.feature import Feature
from fieldcam.camera.genapi.features import (
    BooleanFeature,
    CategoryFeature,
    CommandFeature,
    EnumEntry,
    EnumerationFeature,
    RegisterFeature,
    StringFeature,
)
from fieldcam.camera.genapi.node_map import NodeMap
from fieldcam.camera.genapi.number_features import FloatFeature, IntegerFeature
from fieldcam.camera.genapi.registers import NotConnected
from fieldcam.errors import CameraRefused, FeatureFileInvalid, FeatureRefused
from fieldcam.foreign.bounds import MAX_LISTING_CPU_S

Entry = dict[str, Any]
Found = TypeVar("Found")

LONGEST_REGISTER_BYTES = 256
"""What a longer register holds is a file, or a table, and no setting."""
_KINDS = {
    CategoryFeature: "category",
    CommandFeature: "command",
    IntegerFeature: "integer",
    FloatFeature: "float",
    BooleanFeature: "boolean",
    EnumerationFeature: "enumeration",
    StringFeature: "string",
}


def declared_entries(features: NodeMap) -> Iterator[Entry]:
    """What the feature file alone says; for features on NoCamera."""
    return _entries(features.root, _declared)


def present_entries(features: NodeMap) -> Iterator[Entry]:
    """What the camera says now of what its file declares.

    Raises CameraUnplugged or CameraSilent where the camera goes in the middle.
    """
    return _entries(features.root, _present)


def _entries(root: CategoryFeature, state: Callable[[Feature], Entry]) -> Iterator[Entry]:
    told = {root.name}
    yield from _absent(0, root)
    ends_s = time.process_time() + MAX_LISTING_CPU_S
    for depth, feature in root.walk():
        yield _entry(depth, feature, state if time.process_time() < ends_s else _not_asked)
        if isinstance(feature, CategoryFeature) and feature.name not in told:
            told.add(feature.name)
            yield from _absent(depth + 1, feature)


def _absent(depth: int, category: CategoryFeature) -> Iterator[Entry]:
    """A file that was cut off, or a maker's mistake: somebody would look for the feature."""
    for name in category.absent:
        yield {
            "name": name,
            "depth": depth,
            "type": "missing",
            "display_name": name,
            "description": "",
            "visibility": Visibility.BEGINNER,
            "selects": [],
            "access": None,
            "problem": f"{category.name} names it, and the file does not declare it.",
        }


def _entry(depth: int, feature: Feature, state: Callable[[Feature], Entry]) -> Entry:
    entry = {
        "name": feature.name,
        "depth": depth,
        "type": _kind(feature),
        "display_name": feature.display_name,
        "description": feature.description,
        "visibility": feature.visibility,
        "selects": list(feature.selected),
    }
    try:
        return entry | state(feature)
    except (FeatureFileInvalid, FeatureRefused, CameraRefused) as error:
        return entry | {"access": None, "problem": error.message}


def _not_asked(feature: Feature) -> Entry:
    raise FeatureRefused("It was not asked: the features before it took too long.")


def _declared(feature: Feature) -> Entry:
    access = feature.declared_access
    return {"access": access, "conditional": feature.conditional} | _values(feature)


def _present(feature: Feature) -> Entry:
    access = feature.access
    return {"access": access} | (_values(feature) if access.available else {})


def _kind(feature: Feature) -> str:
    return next((name for kind, name in _KINDS.items() if isinstance(feature, kind)), "register")


def _values(feature: Feature) -> Entry:
    if isinstance(feature, IntegerFeature | FloatFeature):
        return {
            "unit": feature.unit,
            "value": _known(lambda: _finite(feature.value)),
            "min": _known(lambda: _finite(feature.min)),
            "max": _known(lambda: _finite(feature.max)),
            "increment": _known(lambda: _finite(feature.increment)),
        }
    if isinstance(feature, EnumerationFeature):
        entries = [_choice(entry) for entry in feature.entries]
        return {"value": _known(lambda: feature.value), "entries": entries}
    if isinstance(feature, BooleanFeature | StringFeature):
        return {"value": _known(lambda: feature.value)}
    if isinstance(feature, RegisterFeature):
        return {"value": _known(lambda: _hexadecimal(feature))}
    return {}


def _choice(entry: EnumEntry) -> Entry:
    available = _known(lambda: entry.available)
    return {"name": entry.symbol, "code": entry.code, "available": available}


def _finite(value: float | None) -> float | None:
    """A camera's register may hold any bits, and so what is no number."""
    return value if not isinstance(value, float) or math.isfinite(value) else None


def _hexadecimal(feature: RegisterFeature) -> str | None:
    return feature.value.hex() if feature.length <= LONGEST_REGISTER_BYTES else None


def _known(ask: Callable[[], Found]) -> Found | None:
    """None where the answer is in registers that are not there, or not to be read now."""
    try:
        return ask()
    except (NotConnected, FeatureRefused):
        return None
