"""The forecast of a block out of its store, for screens and the command line alike.

Each cluster is followed by itself, and again only where its rows have changed: of the
whole, reading and following take nearly all the time.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from statistics import mean

from sqlite_utils import Database

from fieldcam.growth.crop import CropPlan
from fieldcam.growth.from_tracks import TrackedCluster, camera_record, tracked_cluster
from fieldcam.growth.outlook import Outlook, outlook
from fieldcam.growth.places import Association
from fieldcam.growth.records import BlockRecord
from fieldcam.growth.size_rule import SizeRule
from fieldcam.growth.sprays import SprayDay
from fieldcam.session.over_days.growing import ClusterRows, followed_cluster, tracks_of
from fieldcam.store.queries.blocks import settings, sprays, tree_of_tags, trees
from fieldcam.store.queries.counted import undecided_clusters, unread_clusters
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.rows.orchard import Setting
from fieldcam.store.rows.row import EntryId

COMPARED = (Association.GEOMETRY, Association.SIZE_ORDER)
"""How the app follows fruitlets, and what stands beside it as a check."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownCluster:
    """One cluster, followed in each of the ways."""

    rows: ClusterRows
    tracked: Mapping[Association, TrackedCluster]


def known_clusters(
    database: Database,
    rows: Sequence[ClusterRows],
    before: Mapping[int, KnownCluster],
    methods: Sequence[Association] = COMPARED,
    size_rule: SizeRule | None = None,
) -> Iterator[KnownCluster]:
    """One after the other, so that whoever asks may stop; `before` is what is known by tag."""
    for each in rows:
        known = before.get(each.tag_id)
        if known is not None and known.rows == each:
            yield known
            continue
        cluster = followed_cluster(database, each)
        yield KnownCluster(
            each,
            {
                method: tracked_cluster(
                    each.tag_id, cluster.visits, tracks_of(cluster, method, size_rule)
                )
                for method in methods
            },
        )


def block_outlook(
    database: Database,
    block: EntryId,
    known: Sequence[KnownCluster],
    method: Association = Association.GEOMETRY,
    between: tuple[date | None, date | None] = (None, None),
    today: date | None = None,
) -> Outlook:
    """Raises BadInput where there are no such visits, or nothing grew between them.

    `today` is what the clock says, None where the block's days are made up.
    """
    return outlook(
        block_record(database, block, known, method),
        block_record(database, block, known, Association.SIZE_ORDER),
        between,
        crop_plan(database, block),
        [SprayDay(spray.sprayed_on, spray.product) for spray in sprays(database, block)],
        today,
    )


def block_record(
    database: Database, block: EntryId, known: Sequence[KnownCluster], method: Association
) -> BlockRecord:
    """What the growth model works on."""
    return camera_record(
        row_of(database, "block", block)["name"],
        (each.tracked[method] for each in known),
        tree_of_tags(database, block),
        unread_clusters(database, block),
        undecided_clusters(database, block),
    )


def crop_plan(database: Database, block: EntryId) -> CropPlan | None:
    """What was counted and is wanted on the mean tree; None without a bloom count."""
    every = [settings(database, block, tree) for tree in trees(database, block)]
    of_trees = every or [settings(database, block)]
    blooms = [
        each[Setting.BLOOM_CLUSTERS_PER_TREE]
        for each in of_trees
        if Setting.BLOOM_CLUSTERS_PER_TREE in each
    ]
    if not any(blooms):
        return None
    target = settings(database, block).get(Setting.TARGET_FRUIT_PER_TREE)
    return CropPlan(mean(blooms), target)
