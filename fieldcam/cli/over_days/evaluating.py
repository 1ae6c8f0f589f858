"""`fieldcam evaluate`: the camera's sizes and forecasts against calipers."""

from __future__ import annotations

import argparse
from collections.abc import Sequence, Set
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json, name
from fieldcam.cli.console import emit, emit_json, narrate
from fieldcam.cli.looking import looked_at
from fieldcam.cli.over_days.stored_block import stored_block
from fieldcam.cli.progress import progress
from fieldcam.errors import BadInput

if TYPE_CHECKING:
    from fieldcam.exchange.calipers.reading import CaliperTable
    from fieldcam.growth.evaluation.evaluating import Evaluation, ReadingsScore
    from fieldcam.growth.records import BlockRecord
    from fieldcam.store.queries.blocks import BlockSummary
    from fieldcam.store.read_only import ReadOnlyStore

WHY_HTML = "the report is a page"
WHY_CSV = "it is a table for spreadsheets"


def register(commands: Subparsers[Parser]) -> None:
    parser = add_command(commands, "evaluate", "sizes and forecasts against calipers", _evaluate)
    parser.add_argument("--block", type=name, required=True, metavar="NAME", help="the block")
    parser.add_argument(
        "--calipers", type=Path, required=True, metavar="FILE", help="a caliper table or workbook"
    )
    parser.add_argument(
        "--sgbm",
        action="store_true",
        help="also read every picture again with SGBM stereo, a second or so each",
    )
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write the figures as a table")
    parser.add_argument(
        "--report", type=Path, metavar="HTML", help="write a page with tables and plots"
    )
    add_json(parser)


def _evaluate(arguments: argparse.Namespace) -> None:
    from fieldcam.cli.over_days.evaluation_words import evaluation_lines
    from fieldcam.exchange.calipers.reading import read_calipers
    from fieldcam.exchange.evaluation_report import evaluation_report
    from fieldcam.growth.records import SizeSource

    _check_targets(arguments)
    table = read_calipers(arguments.calipers)
    if not table.named:
        raise BadInput(
            f"{arguments.calipers.name} gives its fruit no names, and camera and calipers are"
            " matched by name, never by size.",
            "Fill in the column fruit.",
        )
    if table.record.source is SizeSource.CAMERA:
        raise BadInput(
            f"{arguments.calipers.name} holds sizes by camera, as `fieldcam export wide` writes"
            " them.",
            "Name a table of caliper sizes.",
        )
    with looked_at(arguments.data) as store:
        block = stored_block(store.database, arguments.block)
        found = _evaluated(arguments, store, block, table)
    _write(arguments, found)
    if arguments.json:
        emit_json(evaluation_report(found))
    else:
        emit("\n".join(evaluation_lines(found)))


def _evaluated(
    arguments: argparse.Namespace, store: ReadOnlyStore, block: BlockSummary, table: CaliperTable
) -> Evaluation:
    from fieldcam.growth.evaluation.evaluating import Evaluation, score_readings
    from fieldcam.growth.warnings.dates import doubtful_dates, other_year
    from fieldcam.session.over_days.evaluating import (
        clusters_of_one,
        named_clusters,
        seconds_per_cluster,
        typed_otherwise,
    )
    from fieldcam.session.over_days.growing import block_rows
    from fieldcam.store.folder import DataKind
    from fieldcam.store.queries.blocks import visits

    calipers = replace(table.record, name=block.name)
    days = [v.day for v in visits(store.database, block.id) if v.accepted]
    photographed = frozenset(rows.tag_id for rows in block_rows(store.database, block.id))
    measured = frozenset(each.tag_id for each in calipers.fruitlets)
    forecasts = _Forecasts(calipers, days, photographed & measured)
    clusters = named_clusters(store.database, block.id)
    readings = score_readings("stored readings", clusters, calipers, forecasts.persist_pct)
    if not any(pair.shown and pair.calipers_mm is not None for pair in readings.pairs):
        raise BadInput(
            f"No fruit of block {block.name} has the same tag, name and day in the pictures and"
            " in the caliper table.",
            other_year(set(calipers.visits), set(days))
            or "Name the fruitlets on the Cluster screen as the table does.",
        )
    others = (_by_sgbm(arguments, store, block, calipers, forecasts),) if arguments.sgbm else ()
    notes = (
        *(text for _, text in doubtful_dates(calipers.visits, date.today())),
        *table.notes,
        clusters_of_one(photographed, measured),
        typed_otherwise(store.database, block.id, calipers),
        *forecasts.whys,
    )
    return Evaluation(
        block.name,
        forecasts.persist_pct(calipers),
        (readings, *others),
        seconds_per_cluster(store.database, block.id),
        store.folder.kind is DataKind.SIMULATED,
        tuple(note for note in notes if note),
    )


def _by_sgbm(
    arguments: argparse.Namespace,
    store: ReadOnlyStore,
    block: BlockSummary,
    calipers: BlockRecord,
    forecasts: _Forecasts,
) -> ReadingsScore:
    """The paper's SGBM-FGMP, on the same pictures and masks."""
    from fieldcam.cli.networks import checked_models
    from fieldcam.growth.evaluation.evaluating import score_readings
    from fieldcam.growth.places import Association
    from fieldcam.session.over_days.evaluating import named_clusters
    from fieldcam.session.over_days.growing import block_rows
    from fieldcam.session.over_days.rereading import read_again
    from fieldcam.values import Matcher, Settings
    from fieldcam.vision.pipeline import Pipeline

    pipeline = Pipeline.from_models(checked_models(arguments.data))
    clusters = named_clusters(store.database, block.id)
    again = read_again(store.database, clusters, pipeline, Settings(stereo=Matcher.SGBM))
    shown = progress(again, len(block_rows(store.database, block.id)), "cluster")
    methods = (Association.GEOMETRY,)
    return score_readings("read again with SGBM", shown, calipers, forecasts.persist_pct, methods)


class _Forecasts:
    """Forecasts from the newest two visits and the clusters that camera and calipers share."""

    def __init__(
        self, calipers: BlockRecord, photographed: Sequence[date], shared_tags: Set[int]
    ) -> None:
        from fieldcam.growth.visits import chosen_interval

        self.whys: list[str] = []
        """Why there is none, a sentence each."""
        self._shared_tags = shared_tags
        self._interval: tuple[date, date] | None = None
        shared = tuple(day for day in calipers.visits if day in photographed)
        try:
            self._interval = chosen_interval(replace(calipers, visits=shared))
        except BadInput:
            days = " and ".join(map(str, shared)) or "no day"
            self.whys.append(
                f"Camera and calipers share {days}: that is too little for a forecast."
            )

    def persist_pct(self, block: BlockRecord) -> float | None:
        from fieldcam.growth.forecast import forecast
        from fieldcam.growth.records import of_clusters

        if self._interval is None:
            return None
        try:
            return forecast(of_clusters(block, self._shared_tags), *self._interval).set_pct
        except BadInput as error:
            if error.message not in self.whys:
                self.whys.append(error.message)
            return None


def _check_targets(arguments: argparse.Namespace) -> None:
    from fieldcam.disk.targets import check_target

    if arguments.csv is not None:
        check_target(arguments.csv, ".csv", WHY_CSV)
    if arguments.report is not None:
        check_target(arguments.report, ".html", WHY_HTML)


def _write(arguments: argparse.Namespace, found: Evaluation) -> None:
    from fieldcam.disk.targets import write_target
    from fieldcam.exchange.evaluation_report import evaluation_csv
    from fieldcam.report.evaluation_page import evaluation_page

    if arguments.csv is not None:
        write_target(arguments.csv, evaluation_csv(found).encode())
        narrate(f"Wrote {arguments.csv}.")
    if arguments.report is not None:
        write_target(arguments.report, evaluation_page([found]).encode())
        narrate(f"Wrote {arguments.report}.")
