"""The size of a block's cards, for the commands that print and see them."""

from __future__ import annotations

import argparse
from contextlib import closing

from fieldcam.cli.arguments import Parser, name, positive_number
from fieldcam.values import TAG_SIZE_MM


def add_tag_size(parser: Parser) -> None:
    parser.add_argument(
        "--tag-size-mm",
        type=positive_number,
        metavar="MM",
        help=f"side of the tag's black square (the block's, else {TAG_SIZE_MM})",
    )


def add_block_of_cards(parser: Parser) -> None:
    parser.add_argument(
        "--block", type=name, metavar="NAME", help="a stored block, whose cards these are"
    )


def tag_size_of(arguments: argparse.Namespace) -> float:
    """In mm: what was said, else what is set up in the named block."""
    from fieldcam.cli.over_days.stored_block import stored_block
    from fieldcam.store.folder import data_path
    from fieldcam.store.queries.blocks import tag_size_mm
    from fieldcam.store.read_only import open_read_only

    if arguments.tag_size_mm is not None or arguments.block is None:
        return float(arguments.tag_size_mm or TAG_SIZE_MM)
    with closing(open_read_only(data_path(arguments.data))) as store:
        return tag_size_mm(store.database, stored_block(store.database, arguments.block).id)
