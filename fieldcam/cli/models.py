"""`fieldcam models list|verify|add`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json
from fieldcam.cli.console import emit, emit_json, narrate, table
from fieldcam.cli.networks import check_network
from fieldcam.errors import ModelMissing
from fieldcam.models import ModelFile, NetworkRole, add_model, described, find_models, verify_model
from fieldcam.store.folder import data_path, data_path_if_any


def register(commands: Subparsers[Parser]) -> None:
    parser = commands.add_parser("models", help="the networks: list, verify or replace them")
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    add_json(add_command(actions, "list", "list the networks in use", _list))
    add_json(
        add_command(actions, "verify", "check the networks' files against their hashes", _verify)
    )
    add = add_command(actions, "add", "use a network of your own in place of a shipped one", _add)
    add.add_argument(
        "role",
        choices=[*map(str, NetworkRole)],
        metavar="segmentation|stereo",
        help="what the network does",
    )
    add.add_argument("file", type=Path, help="an ONNX file, as the export tools make it")
    add_json(add)


def _list(arguments: argparse.Namespace) -> None:
    models = find_models(data_path_if_any(arguments.data))
    if arguments.json:
        emit_json({"models": [_entry(model) for model in models.files]})
        return
    rows = [("role", "from", "sha256", "file")]
    rows += [(m.role, m.origin, m.sha256[:12], str(m.path)) for m in models.files]
    for line in table(rows, "<<<<"):
        emit(line)
    narrate(models.honesty)


def _verify(arguments: argparse.Namespace) -> None:
    models = find_models(data_path_if_any(arguments.data))
    problems = {model.role: _problem(model) for model in models.files}
    if arguments.json:
        entries = [
            _entry(m) | {"problem": str(problems[m.role] or "") or None} for m in models.files
        ]
        emit_json({"models": entries, "ok": not any(problems.values())})
    else:
        for model in models.files:
            emit(f"{model.role}: {'not intact' if problems[model.role] else 'intact'}")
    for problem in problems.values():
        if problem is not None:
            raise problem


def _add(arguments: argparse.Namespace) -> None:
    role, data = NetworkRole(arguments.role), data_path(arguments.data)
    check_network(described(role, arguments.file, data), arguments.file)
    added = add_model(role, arguments.file, data)
    if arguments.json:
        emit_json(_entry(added))
    else:
        emit(f"{added.role}: {added.path}")


def _problem(model: ModelFile) -> ModelMissing | None:
    try:
        verify_model(model)
    except ModelMissing as error:
        return error
    return None


def _entry(model: ModelFile) -> dict[str, Any]:
    return {
        "role": model.role,
        "origin": model.origin,
        "file": str(model.path),
        "sha256": model.sha256,
    }
