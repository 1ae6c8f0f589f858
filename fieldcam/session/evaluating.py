"""A stored block beside what calipers say of it."""

from __future__ import annotations

from collections.abc import Iterator, Set

from sqlite_utils import Database

from fieldcam.growth.evaluation.evaluating import Seconds, seconds_of
from fieldcam.growth.evaluation.named import NamedCluster
from fieldcam.growth.places import Place
from fieldcam.growth.records import BlockRecord
from fieldcam.session.over_days.growing import block_rows, followed_cluster
from fieldcam.store.queries.blocks import visits
from fieldcam.store.queries.calipers import caliper_sizes, named_fruitlets
from fieldcam.store.queries.durations import is_pause, visit_times
from fieldcam.store.rows import EntryId

SAME_MM = 0.005
"""Sizes that differ by no more were rounded."""


def named_clusters(database: Database, block: EntryId) -> Iterator[NamedCluster]:
    """All clusters of a block, one at a time, with the names given on the Cluster screen."""
    names: dict[int, dict[Place, str]] = {}
    for each in named_fruitlets(database, block):
        names.setdefault(each.tag_id, {})[Place(each.reading, each.fruitlet)] = each.fruit
    for rows in block_rows(database, block):
        cluster = followed_cluster(database, rows)
        found = names.get(cluster.tag_id, {})
        yield NamedCluster(cluster.tag_id, cluster.visits, found, cluster.words)


def typed_otherwise(database: Database, block: EntryId, table: BlockRecord) -> str:
    """A sentence on caliper sizes that a table does not have as they were typed at the tags.

    Empty where there are none.
    """
    known = {(each.tag_id, each.fruitlet): each.sightings for each in table.fruitlets}
    other = missing = 0
    for size in caliper_sizes(database, block):
        seen = known.get((size.tag_id, size.fruit), {}).get(size.day)
        if seen is None or seen.diameter_mm is None:
            missing += 1
        elif abs(seen.diameter_mm - size.diameter_mm) > SAME_MM:
            other += 1
    if not other and not missing:
        return ""
    return (
        f"Caliper sizes typed at the tags: {other} with another value in the table, {missing} not"
        " in it at all; only the table counts here."
    )


def clusters_of_one(photographed: Set[int], measured: Set[int]) -> str:
    """A sentence on clusters that only the pictures have, or only the table; empty without."""
    only = (
        ("tags of the table that are not in the block", measured - photographed),
        ("tags of the block that are not in the table", photographed - measured),
    )
    told = [f"{what}: {', '.join(map(str, sorted(tags)))}" for what, tags in only if tags]
    return f"Left out of both forecasts, {'; '.join(told)}." if told else ""


def seconds_per_cluster(database: Database, block: EntryId) -> dict[str, Seconds]:
    """Over all visits, by what was timed; pauses are left out."""
    clusters = [
        cluster for visit in visits(database, block)
        for cluster in visit_times(database, visit.id).clusters
    ]  # fmt: skip
    timed = {
        "from the first picture to its acceptance": [c.at_cluster_s for c in clusters],
        "from one cluster to the next, walking included": [c.since_last_s for c in clusters],
    }
    found = {
        what: seconds_of([s for s in times if s is not None and not is_pause(s)])
        for what, times in timed.items()
    }
    return {what: seconds for what, seconds in found.items() if seconds is not None}
