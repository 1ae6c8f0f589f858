"""`fieldcam tags-print`: numbered tags at true size, for any printer."""

from __future__ import annotations

import argparse
from pathlib import Path

from fieldcam.cli.arguments import (
    Parser,
    Subparsers,
    add_command,
    add_json,
    positive_count,
    positive_number,
    tag_id,
)
from fieldcam.cli.console import emit, emit_json
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
    parser.add_argument(
        "--tag-size-mm",
        type=positive_number,
        default=TAG_SIZE_MM,
        metavar="MM",
        help="side of the tag's black square (%(default)s)",
    )
    parser.add_argument("--paper", choices=PAPERS, default="a4", help="its format (%(default)s)")
    add_json(parser)


def _print(arguments: argparse.Namespace) -> None:
    from fieldcam.exchange.targets import check_target, write_target
    from fieldcam.report.pdf import pdf_document
    from fieldcam.report.tag_sheets import Layout, Paper, tag_sheets

    check_target(arguments.out, ".pdf", "the tags are written as PDF")
    last = arguments.first + arguments.count - 1
    if last > HIGHEST_TAG_ID:
        raise BadInput(f"There is no tag {last}: tag36h11 ends at {HIGHEST_TAG_ID}.")
    layout = Layout(Paper[arguments.paper.upper()], arguments.tag_size_mm)
    sheets = tag_sheets(arguments.first, arguments.count, layout)
    write_target(arguments.out, pdf_document(sheets, layout.paper))
    if arguments.json:
        tags = {"first": arguments.first, "last": last, "tag_size_mm": layout.tag_size_mm}
        pages = {"paper": arguments.paper, "pages": len(sheets), "tags_per_page": layout.per_page}
        emit_json({"file": str(arguments.out), **tags, **pages})
    else:
        emit(f"{arguments.out}: tags {arguments.first} to {last} on pages: {len(sheets)}.")
        emit("Print at 100 %, not fitted to the page, and measure the ruler below: 100 mm.")
