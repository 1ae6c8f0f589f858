"""`fieldcam growth`: growth rates, and what share of the fruitlets will stay."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.cli.arguments import (
    Parser,
    Subparsers,
    add_command,
    add_json,
    day,
    name,
    positive_number,
)
from fieldcam.cli.console import emit, emit_json, narrate
from fieldcam.cli.looking import READ_AGAIN, looked_at
from fieldcam.cli.over_days.stored_block import stored_block
from fieldcam.cli.progress import progress
from fieldcam.errors import BadInput
from fieldcam.growth.places import Association
from fieldcam.growth.size_rule import SizeRule

if TYPE_CHECKING:
    from fieldcam.growth.crop import CropPlan
    from fieldcam.growth.outlook import Outlook
    from fieldcam.session.over_days.block_growth import KnownCluster
    from fieldcam.store.queries.blocks import BlockSummary
    from fieldcam.store.read_only import ReadOnlyStore

_METHOD = Association.GEOMETRY
WHY_HTML = "the report is a page"
SIMULATED = "The captures are simulated."


def register(commands: Subparsers[Parser]) -> None:
    parser = add_command(commands, "growth", "growth rates and predicted fruit set", _growth)
    parser.add_argument(
        "--block",
        type=name,
        metavar="NAME",
        help="a stored block (the newest with two visits), or the table's",
    )
    parser.add_argument(
        "--calipers", type=Path, metavar="CSV", help="a caliper table or workbook instead"
    )
    parser.add_argument(
        "--dates",
        type=_days,
        default=(),
        metavar="D1,D2,...",
        help="of the visits, where the table only numbers them",
    )
    parser.add_argument(
        "--associate",
        type=Association,
        choices=list(Association),
        help=f"how fruitlets are followed from picture to picture ({_METHOD})",
    )
    parser.add_argument(
        "--same-day",
        type=SizeRule,
        choices=list(SizeRule),
        help="which size counts where two pictures of a day show a fruitlet"
        f" ({_METHOD.size_rule}; with --associate paper {Association.PAPER.size_rule})",
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
    parser.add_argument("--report", type=Path, metavar="HTML", help="write a page to print")
    add_json(parser)


@dataclass(frozen=True, slots=True, eq=False)
class _Told:
    """What is said of a block, and what only its page shows."""

    growth: Outlook
    notes: tuple[str, ...]
    thumbnails: Mapping[int, bytes] = field(default_factory=dict)
    simulated: bool = False


def _growth(arguments: argparse.Namespace) -> None:
    from fieldcam.cli.over_days.growth_words import growth_lines
    from fieldcam.disk.targets import check_target
    from fieldcam.exchange.growth_report import growth_report

    if arguments.report is not None:
        check_target(arguments.report, ".html", WHY_HTML)
    told = _of_stored(arguments) if arguments.calipers is None else _of_table(arguments)
    if arguments.report is not None:
        _write_page(arguments.report, told)
    if arguments.json:
        emit_json(growth_report(told.growth, told.notes))
    else:
        emit("\n".join(growth_lines(told.growth, told.notes)))


def _of_table(arguments: argparse.Namespace) -> _Told:
    from fieldcam.exchange.calipers.reading import read_calipers
    from fieldcam.growth.outlook import outlook
    from fieldcam.growth.size_order import in_size_order
    from fieldcam.growth.sprays import SprayDay

    _refuse_picture_options(arguments)
    plan = _plan(arguments)
    table = read_calipers(arguments.calipers, arguments.dates)
    record = replace(table.record, name=arguments.block or table.record.name)
    between = arguments.start, arguments.end
    sprays = [SprayDay(day) for day in arguments.sprayed]
    growth = outlook(record, in_size_order(record), between, plan, sprays, date.today())
    return _Told(growth, table.notes)


def _of_stored(arguments: argparse.Namespace) -> _Told:
    _refuse_table_options(arguments)
    with looked_at(arguments.data) as store:
        return _of_block(arguments, store, stored_block(store.database, arguments.block, visits=2))


def _of_block(arguments: argparse.Namespace, store: ReadOnlyStore, block: BlockSummary) -> _Told:
    from fieldcam.growth.warnings.block import Warning
    from fieldcam.session.over_days.block_growth import COMPARED, block_outlook, known_clusters
    from fieldcam.session.over_days.growing import block_rows
    from fieldcam.store.folder import DataKind
    from fieldcam.store.seals import damage_sentence

    method: Association = arguments.associate or _METHOD
    methods = tuple(dict.fromkeys((method, *COMPARED)))
    rows = block_rows(store.database, block.id)
    followed = known_clusters(store.database, rows, {}, methods, arguments.same_day)
    known = tuple(progress(followed, len(rows), "cluster"))
    between = arguments.start, arguments.end
    simulated = store.folder.kind is DataKind.SIMULATED
    today = None if simulated else date.today()
    growth = block_outlook(store.database, block.id, known, method, between, today)
    if store.damaged:
        left_out = Warning("damaged_readings", f"{damage_sentence(store.damaged)} {READ_AGAIN}")
        growth = replace(growth, warnings=(left_out, *growth.warnings))
    pictures = arguments.report is not None
    return _Told(
        growth,
        (SIMULATED,) if simulated else (),
        _thumbnails(store, known, growth, method) if pictures else {},
        simulated,
    )


def _thumbnails(
    store: ReadOnlyStore, known: tuple[KnownCluster, ...], growth: Outlook, method: Association
) -> dict[int, bytes]:
    from fieldcam.session.over_days.cluster_pictures import cluster_pictures

    tracked = ((each, each.tracked[method]) for each in known)
    return cluster_pictures(store.database, tracked, growth.found.end.days[-1])


def _write_page(path: Path, told: _Told) -> None:
    from fieldcam.disk.targets import write_target
    from fieldcam.report.growth_page import growth_page

    page = growth_page(told.growth, told.notes, told.thumbnails, told.simulated)
    write_target(path, page.encode())
    narrate(f"Wrote {path}.")


def _refuse_table_options(arguments: argparse.Namespace) -> None:
    """What a stored block knows itself is said once, in Set-up."""
    given = {
        "--dates": arguments.dates,
        "--bloom-clusters": arguments.bloom_clusters,
        "--target": arguments.target,
        "--sprayed": arguments.sprayed,
    }
    for option, value in given.items():
        if value:
            raise BadInput(
                f"{option} goes with --calipers.",
                "Of a stored block Set-up (E) in the app says it.",
            )


def _refuse_picture_options(arguments: argparse.Namespace) -> None:
    """A table names its fruit, and has one size of each on a day."""
    given = {"--associate": arguments.associate, "--same-day": arguments.same_day}
    for option, value in given.items():
        if value is not None:
            raise BadInput(f"{option} goes with stored pictures, not with --calipers.")


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
