"""Fruitlets followed by a camera, as the growth model takes them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date

from fieldcam.growth.places import ClusterVisit, Track
from fieldcam.growth.records import BlockRecord, FruitletRecord, SizeSource


@dataclass(frozen=True, slots=True)
class TrackedCluster:
    """One cluster with its fruitlets followed over its visits."""

    tag_id: int
    days: tuple[date, ...]
    """On which the cluster was photographed, or something was marked."""
    tracks: tuple[Track, ...]


def tracked_cluster(
    tag_id: int, visits: Sequence[ClusterVisit], tracks: Sequence[Track]
) -> TrackedCluster:
    """Without the visits' readings, which take room."""
    return TrackedCluster(tag_id, tuple(v.day for v in visits), tuple(tracks))


def camera_record(
    name: str,
    clusters: Iterable[TrackedCluster],
    tree_of: Mapping[int, str] | None = None,
    unread: Mapping[date, int] | None = None,
    undecided: Mapping[date, int] | None = None,
) -> BlockRecord:
    """All clusters of a block; fruitlets are called 1, 2 ... in each."""
    fruitlets: list[FruitletRecord] = []
    visited: dict[date, set[int]] = {}
    for cluster in clusters:
        for day in cluster.days:
            visited.setdefault(day, set()).add(cluster.tag_id)
        fruitlets += [_fruitlet(cluster.tag_id, track) for track in cluster.tracks]
    return BlockRecord(
        name,
        SizeSource.CAMERA,
        tuple(sorted(visited)),
        {day: frozenset(tags) for day, tags in sorted(visited.items())},
        tuple(fruitlets),
        dict(tree_of or {}),
        dict(unread or {}),
        dict(undecided or {}),
    )


def _fruitlet(tag_id: int, track: Track) -> FruitletRecord:
    sightings = {day: visit.sighting for day, visit in track.visits.items()}
    return FruitletRecord(tag_id, str(track.number), sightings)
