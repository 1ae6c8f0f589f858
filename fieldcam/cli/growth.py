"""`fieldcam growth`: growth rates, and what share of the fruitlets will stay."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json, day, positive_number
from fieldcam.cli.console import emit, emit_json
from fieldcam.errors import BadInput

if TYPE_CHECKING:
    from fieldcam.growth.crop import CropPlan
    from fieldcam.growth.records import BlockRecord


def register(commands: Subparsers[Parser]) -> None:
    parser = add_command(commands, "growth", "growth rates and predicted fruit set", _growth)
    parser.add_argument(
        "--calipers", type=Path, required=True, metavar="CSV", help="a caliper table or workbook"
    )
    parser.add_argument(
        "--dates",
        type=_days,
        default=(),
        metavar="D1,D2,...",
        help="of the visits, where the table only numbers them",
    )
    parser.add_argument(
        "--from", dest="start", type=day, metavar="DATE", help="the first of the two visits"
    )
    parser.add_argument(
        "--to", dest="end", type=day, metavar="DATE", help="the second (the newest)"
    )
    parser.add_argument(
        "--bloom-clusters", type=positive_number, metavar="N", help="mean flower clusters of a tree"
    )
    parser.add_argument(
        "--target", type=positive_number, metavar="N", help="fruit that a tree should carry"
    )
    parser.add_argument(
        "--sprayed",
        type=day,
        action="append",
        default=[],
        metavar="DATE",
        help="a day of thinning; may be given again",
    )
    add_json(parser)


def _growth(arguments: argparse.Namespace) -> None:
    from fieldcam.exchange.calipers import read_calipers

    plan = _plan(arguments)
    table = read_calipers(arguments.calipers, arguments.dates)
    print_growth(arguments, table.record, table.notes, plan)


def print_growth(
    arguments: argparse.Namespace,
    record: BlockRecord,
    notes: Sequence[str],
    plan: CropPlan | None,
) -> None:
    """The forecast of a block, wherever its sizes came from."""
    from fieldcam.cli.growth_words import growth_lines
    from fieldcam.exchange.growth_report import growth_report
    from fieldcam.growth.crop import crop_forecast
    from fieldcam.growth.forecast import forecast, trend
    from fieldcam.growth.visits import chosen_interval
    from fieldcam.growth.warnings import warnings_about

    found = forecast(record, *chosen_interval(record, arguments.start, arguments.end))
    told = (
        found,
        warnings_about(found, arguments.sprayed),
        trend(record),
        None if plan is None else crop_forecast(found, plan),
        notes,
    )
    if arguments.json:
        emit_json(growth_report(*told))
    else:
        emit("\n".join(growth_lines(*told)))


def _plan(arguments: argparse.Namespace) -> CropPlan | None:
    from fieldcam.growth.crop import CropPlan

    if arguments.bloom_clusters is not None:
        return CropPlan(arguments.bloom_clusters, arguments.target)
    if arguments.target is not None:
        raise BadInput(
            "A target needs the flower clusters of a tree.",
            "Name them with --bloom-clusters; the measured clusters are only some of them.",
        )
    return None


def _days(text: str) -> tuple[date, ...]:
    return tuple(day(part.strip()) for part in text.split(","))
