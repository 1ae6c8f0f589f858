"""What Two days shows: a cluster's pictures, its fruitlets over them, and what is asked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sqlite_utils import Database

from fieldcam.growth.places import Track
from fieldcam.session.over_days.growing import (
    ClusterRows,
    followed_cluster,
    rows_with_undecided,
    tracks_of,
    undecided,
)
from fieldcam.session.state import WalkState, missing
from fieldcam.session.viewing import expected_at, shown_picture
from fieldcam.store.objects import Objects
from fieldcam.store.queries.history import capture_record, cluster_marks
from fieldcam.store.rows.fruit import MissingWord
from fieldcam.store.rows.row import EntryId
from fieldcam.tui.screens.cluster_page import block_tags, tag_to_show
from fieldcam.tui.screens.pairs import Pair, pairs_of


@dataclass(frozen=True, slots=True, eq=False)
class FollowedPictures:
    """A cluster's accepted pictures, and its fruitlets over them."""

    tags: tuple[int, ...]
    """Of the block."""
    rows: ClusterRows
    """What it was made of."""
    groups: tuple[tuple[Pair, ...], ...]
    """For each two visits on end the pairs of their pictures."""
    tracks: tuple[Track, ...]
    left: Mapping[EntryId, int]
    """By picture that is not decided: how many missing fruitlets wait for an answer."""

    def told(self, pair: Pair) -> tuple[MissingWord, ...]:
        """The answers on the later day."""
        day = pair[1].record.day
        return next((visit.told for visit in self.rows.visits if visit.day == day), ())


def followed(
    state: WalkState, asked: int | None, before: FollowedPictures | None, database: Database
) -> FollowedPictures | None:
    """Read and followed anew only where its rows have changed; None without a cluster."""
    objects, tags = Objects(state.folder), block_tags(database, state)
    tag_id = tag_to_show(asked, state, tags)
    if tag_id is None:
        return None
    rows = rows_with_undecided(database, state.route.block, tag_id)
    if before is not None and before.rows == rows:
        return replace(before, tags=tags, left=_left(database, state.route.block, tag_id))
    cluster = followed_cluster(database, rows)
    whole = {view.id: view.reading for visit in cluster.visits for view in visit.views}
    days = []
    for visit in rows.visits:
        records = [capture_record(database, picture.capture) for picture in visit.pictures]
        days.append(
            [
                shown_picture(database, objects, record, whole[record.reading.id])
                for record in records
                if record is not None and record.reading is not None and record.reading.id in whole
            ]
        )
    return FollowedPictures(
        tags,
        rows,
        pairs_of([day for day in days if day]),
        tracks_of(cluster),
        _left(database, state.route.block, tag_id),
    )


def _left(database: Database, block: EntryId, tag_id: int) -> dict[EntryId, int]:
    marks = cluster_marks(database, block, tag_id)
    found = {}
    for record in undecided(database, block, tag_id):
        assert record.visit is not None  # it is of a visit
        told = sum(mark.count for mark in marks if mark.visit == record.visit)
        before = expected_at(database, record.visit, tag_id).fruitlets
        found[record.id] = max(0, missing(record, before) - told)
    return found
