"""`fieldcam route`: the order in which a block is walked."""

from __future__ import annotations

import argparse
from pathlib import Path

from fieldcam.cli.arguments import Parser, Subparsers, add_command, name
from fieldcam.cli.console import emit


def register(commands: Subparsers[Parser]) -> None:
    route = commands.add_parser("route", help="the order in which a block is walked")
    actions = route.add_subparsers(title="commands", metavar="COMMAND", required=True)
    parser = add_command(actions, "import", "plan a route from a table", _import)
    parser.add_argument(
        "file", type=Path, help="a table with the columns tree and tag, in walking order"
    )
    parser.add_argument("--block", type=name, required=True, metavar="NAME", help="made when new")


def _import(arguments: argparse.Namespace) -> None:
    from fieldcam.exchange.route_table import read_route
    from fieldcam.session.set_up.planning import keep_route
    from fieldcam.store.folder import DataKind, data_path
    from fieldcam.store.rows.orchard import Block
    from fieldcam.store.store import open_store

    route = read_route(arguments.file)
    with open_store(data_path(arguments.data), DataKind.FIELD) as store:
        block = store.block(Block(arguments.block))
        emit(f"Block {arguments.block}: {keep_route(store, block, route)}")
