"""`fieldcam tags-print`: numbered tags at true size, for any printer."""

from __future__ import annotations

import argparse
from pathlib import Path

from fieldcam.cli.arguments import (
    Parser,
    Subparsers,
    add_command,
    add_json,
    name,
    positive_count,
    tag_id,
)
from fieldcam.cli.card_size import add_tag_size
from fieldcam.cli.console import emit, emit_json, narrate
from fieldcam.errors import BadInput
from fieldcam.values import HIGHEST_TAG_ID, TAG_SIZE_MM

PAPERS = ("a4", "letter")


def register(commands: Subparsers[Parser]) -> None:
    parser = add_command(commands, "tags-print", "a PDF of numbered tags at true size", _print)
    parser.add_argument("out", type=Path, metavar="OUT.pdf", help="the file to write")
    parser.add_argument(
        "--first", type=tag_id, default=0, metavar="N", help="the first number (%(default)s)"
    )
    parser.add_argument(
        "--count", type=positive_count, default=70, metavar="M", help="how many (%(default)s)"
    )
    add_tag_size(parser)
    parser.add_argument(
        "--block",
        type=name,
        metavar="NAME",
        help="whose cards these are: their size is set up with it",
    )
    parser.add_argument("--paper", choices=PAPERS, default="a4", help="its format (%(default)s)")
    add_json(parser)


def _print(arguments: argparse.Namespace) -> None:
    from fieldcam.disk.targets import check_target

    check_target(arguments.out, ".pdf", "the tags are written as PDF")
    last = arguments.first + arguments.count - 1
    if last > HIGHEST_TAG_ID:
        raise BadInput(f"There is no tag {last}: tag36h11 ends at {HIGHEST_TAG_ID}.")
    if arguments.block is None:
        _write(arguments, last, arguments.tag_size_mm or TAG_SIZE_MM)
    else:
        _print_for_block(arguments, last)


def _print_for_block(arguments: argparse.Namespace, last: int) -> None:
    """The walk will take the cards for what they are."""
    from fieldcam.store.folder import DataKind, data_path
    from fieldcam.store.queries.blocks import block_named, tag_size_mm
    from fieldcam.store.rows.orchard import Block, BlockSetting, Setting
    from fieldcam.store.store import open_store

    with open_store(data_path(arguments.data), DataKind.FIELD) as store:
        known = block_named(store.database, arguments.block)
        set_up_mm = TAG_SIZE_MM if known is None else tag_size_mm(store.database, known.id)
        size_mm = arguments.tag_size_mm or set_up_mm
        _write(arguments, last, size_mm)
        block = store.block(Block(arguments.block))
        if size_mm != set_up_mm:
            store.append(BlockSetting(block, Setting.TAG_SIZE_MM, size_mm))


def _write(arguments: argparse.Namespace, last: int, size_mm: float) -> None:
    from fieldcam.disk.targets import write_target
    from fieldcam.report.pdf import pdf_document
    from fieldcam.report.tag_sheets import Paper, SheetLayout, tag_sheets

    layout = SheetLayout(Paper[arguments.paper.upper()], size_mm)
    sheets = tag_sheets(arguments.first, arguments.count, layout)
    write_target(arguments.out, pdf_document(sheets, layout.paper))
    if arguments.json:
        tags = {"first": arguments.first, "last": last, "tag_size_mm": layout.tag_size_mm}
        pages = {"paper": arguments.paper, "pages": len(sheets), "tags_per_page": layout.per_page}
        block = {} if arguments.block is None else {"block": arguments.block}
        emit_json({"file": str(arguments.out), **tags, **pages, **block})
    else:
        emit(f"{arguments.out}: tags {arguments.first} to {last} on pages: {len(sheets)}.")
        emit("Print at 100 %, not fitted to the page, and measure the ruler below: 100 mm.")
    if arguments.block is None and size_mm != TAG_SIZE_MM:
        narrate(
            f"Tell their block that its tags have {size_mm:g} mm: print with --block NAME, or"
            " choose it in Set-up (E) of the app."
        )
