"""`fieldcam export`: what is stored, for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.cli.arguments import Parser, Subparsers, add_command, name
from fieldcam.cli.console import narrate
from fieldcam.cli.looking import looked_at
from fieldcam.cli.over_days.stored_block import stored_block
from fieldcam.cli.progress import progress
from fieldcam.errors import BadInput
from fieldcam.words import number_of

if TYPE_CHECKING:
    from fieldcam.growth.records import BlockRecord

_BLOCK = "a stored block (the newest with two visits)"
WHY_CSV = "it is a table for spreadsheets"


def register(commands: Subparsers[Parser]) -> None:
    parser = commands.add_parser("export", help="what is stored, for other programs")
    shapes = parser.add_subparsers(title="shapes", metavar="SHAPE", required=True)
    wide = add_command(shapes, "wide", "a row for each fruitlet, a column for each visit", _wide)
    wide.add_argument("out", type=Path, metavar="OUT", help="the CSV file to write")
    wide.add_argument("--block", type=name, metavar="NAME", help=_BLOCK)


def _wide(arguments: argparse.Namespace) -> None:
    from fieldcam.disk.targets import check_new_target, write_target
    from fieldcam.exchange.calipers.wide import wide_table

    check_new_target(arguments.out, ".csv", WHY_CSV)
    record = _followed(arguments)
    write_target(arguments.out, wide_table(record).encode())
    narrate(
        f"Wrote {number_of(len(record.fruitlets), 'fruitlet')} of block {record.name} to"
        f" {arguments.out}; `fieldcam growth --calipers {arguments.out}` reads it."
    )


def _followed(arguments: argparse.Namespace) -> BlockRecord:
    """The block's fruitlets, followed as `fieldcam growth` does."""
    from fieldcam.growth.places import Association
    from fieldcam.session.over_days.block_growth import block_record, known_clusters
    from fieldcam.session.over_days.growing import block_rows

    method = Association.GEOMETRY
    with looked_at(arguments.data) as store:
        block = stored_block(store.database, arguments.block, visits=2)
        rows = block_rows(store.database, block.id)
        if not rows:
            raise BadInput(
                f"Block {block.name} has no accepted picture: there is nothing to export."
            )
        known = known_clusters(store.database, rows, {}, (method,))
        followed = tuple(progress(known, len(rows), "cluster"))
        return block_record(store.database, block.id, followed, method)
