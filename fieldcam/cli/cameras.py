"""`fieldcam camera features`: what a camera's feature file declares."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json
from fieldcam.cli.console import emit, emit_json, narrate, table
from fieldcam.errors import DeviceError, FeatureFileInvalid

if TYPE_CHECKING:
    from fieldcam.camera.genapi import Feature, NodeMap

Found = TypeVar("Found")

ASK_THE_CAMERA = "(ask the camera)"
"""Printed where only registers know."""
INDENT = "  "
UNBOUNDED = ([-(2**63), 2**63 - 1], [-sys.float_info.max, sys.float_info.max])
"""Ranges that say nothing but the type."""


def register(commands: Subparsers[Parser]) -> None:
    parser = commands.add_parser("camera", help="cameras and what they can be set to")
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    features = add_command(actions, "features", "list a camera's features", _features)
    features.add_argument(
        "--xml",
        type=Path,
        required=True,
        metavar="FILE",
        help="a GenICam feature file, plain or zipped; needs no camera",
    )
    add_json(features)


def _features(arguments: argparse.Namespace) -> None:
    from fieldcam.camera.genapi import NoCamera, NodeMap, load_feature_file

    document = load_feature_file(_read(arguments.xml))
    features = NodeMap(document, NoCamera())
    entries = [_entry(depth, feature) for depth, feature in features.root.walk()]
    if arguments.json:
        emit_json(
            {
                "vendor": document.vendor,
                "model": document.model,
                "schema_version": document.schema_version,
                "features": entries,
            }
        )
        return
    rows = [["feature", "type", "access", "for", "unit", "values"]]
    rows += [_row(entry) for entry in entries]
    for line in table(rows, "<<<<<<"):
        emit(line)
    _tell(features, len(entries))


def _read(path: Path) -> bytes:
    from fieldcam.camera.genapi.feature_file import LARGEST_FILE_BYTES

    try:
        with path.open("rb") as file:
            return file.read(LARGEST_FILE_BYTES + 1)
    except OSError as error:
        raise FeatureFileInvalid(f"{path} cannot be read: {error.strerror}.") from error


def _tell(features: NodeMap, listed: int) -> None:
    document = features.document
    narrate(
        f"{document.vendor} {document.model}, GenApi {document.schema_version}: "
        f"{listed} features in the category tree, {len(document.nodes)} nodes in all."
    )
    narrate("? behind an access: it depends on the camera's present settings.")


def _entry(depth: int, feature: Feature) -> dict[str, Any]:
    """One feature as JSON; null where only the camera can tell.

    What is wrong with one feature is told in its place, so that the others are seen.
    """
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
        return entry | _access(feature) | _values(feature)
    except FeatureFileInvalid as error:
        return entry | {"access": None, "conditional": False, "problem": error.message}


def _access(feature: Feature) -> dict[str, Any]:
    return {"access": feature.declared_access, "conditional": feature.conditional}


def _kind(feature: Feature) -> str:
    from fieldcam.camera import genapi

    kinds = {
        genapi.CategoryFeature: "category",
        genapi.CommandFeature: "command",
        genapi.IntegerFeature: "integer",
        genapi.FloatFeature: "float",
        genapi.BooleanFeature: "boolean",
        genapi.EnumerationFeature: "enumeration",
        genapi.StringFeature: "string",
    }
    return next((name for kind, name in kinds.items() if isinstance(feature, kind)), "register")


def _values(feature: Feature) -> dict[str, Any]:
    from fieldcam.camera.genapi import (
        BooleanFeature,
        EnumerationFeature,
        FloatFeature,
        IntegerFeature,
        StringFeature,
    )

    if isinstance(feature, IntegerFeature | FloatFeature):
        return {
            "unit": feature.unit,
            "value": _known(lambda: feature.value),
            "min": _known(lambda: feature.min),
            "max": _known(lambda: feature.max),
            "increment": _known(lambda: feature.increment),
        }
    if isinstance(feature, EnumerationFeature):
        entries = [{"name": entry.symbol, "code": entry.code} for entry in feature.entries]
        return {"value": _known(lambda: feature.value), "entries": entries}
    if isinstance(feature, BooleanFeature | StringFeature):
        return {"value": _known(lambda: feature.value)}
    return {}


def _known(ask: Callable[[], Found]) -> Found | None:
    """None where the answer is in the camera's registers."""
    try:
        return ask()
    except DeviceError:
        return None


def _row(entry: dict[str, Any]) -> list[str]:
    conditional = "?" if entry["conditional"] else ""
    return [
        INDENT * entry["depth"] + entry["name"],
        entry["type"],
        "" if entry["type"] == "category" else f"{entry['access'] or '-'}{conditional}",
        entry["visibility"].lower(),
        entry.get("unit", ""),
        " ".join(_words(entry)),
    ]


def _words(entry: dict[str, Any]) -> Iterator[str]:
    if "problem" in entry:
        yield entry["problem"]
    if "entries" in entry:
        yield ", ".join(choice["name"] for choice in entry["entries"])
    if entry.get("value") is not None:
        yield f"= {entry['value']}"
    elif "min" in entry:
        yield _range(entry)
    elif "value" in entry and "entries" not in entry:
        yield ASK_THE_CAMERA


def _range(entry: dict[str, Any]) -> str:
    ends = [entry["min"], entry["max"]]
    if ends == [None, None] or ends in UNBOUNDED:
        return ASK_THE_CAMERA
    step = entry["increment"]
    steps = f" in steps of {_number(step)}" if step not in (None, 1) else ""
    return f"{_number(ends[0])} to {_number(ends[1])}{steps}"


def _number(value: float | None) -> str:
    if value is None:
        return ASK_THE_CAMERA
    return str(value) if isinstance(value, int) else f"{value:g}"
