"""The route of a visit: what is done, what comes next, what to expect there."""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from sqlite_utils import Database

from fieldcam.store.connection import rows
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.rows import EntryId
from fieldcam.values import Expectation, Status


class ClusterState(StrEnum):
    """How far a cluster is on this visit."""

    TODO = "todo"
    WAITING = "waiting"
    """Saved, not analysed yet."""
    UNDECIDED = "undecided"
    """Analysed; the operator has not decided."""
    RETAKE = "retake"
    """To be taken again: the operator said so, or the verdict and the operator has not decided."""
    ACCEPTED = "accepted"
    SKIPPED = "skipped"


OPEN_STATES = (ClusterState.TODO, ClusterState.RETAKE)
"""States in which a cluster still needs a picture."""
TAKEN_STATES = (ClusterState.WAITING, ClusterState.UNDECIDED, ClusterState.ACCEPTED)
"""States in which a cluster has its picture."""
SETTLED_STATES = (ClusterState.ACCEPTED, ClusterState.SKIPPED)
"""States in which nothing is left to do or to decide."""


@dataclass(frozen=True, slots=True)
class Stop:
    """One cluster of the route."""

    tag_id: int
    tree: EntryId | None
    tree_label: str
    """Empty where the tree is not known."""
    state: ClusterState
    captures: tuple[EntryId, ...]
    """Of this visit, discarded ones apart; the last one decides the state."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a cluster is on the route; all count from 1."""

    tree: int
    trees: int
    cluster: int
    """Within its tree."""
    clusters: int


@dataclass(frozen=True, slots=True)
class WalkRoute:
    """The clusters of a block in walking order, with their state on one visit."""

    block: EntryId
    visit: EntryId
    stops: tuple[Stop, ...]
    planned: bool = False
    """Its order was given; else it is what was learned by walking."""

    @property
    def taken(self) -> int:
        """How many clusters have a picture that need not be taken again."""
        return sum(stop.state in TAKEN_STATES for stop in self.stops)

    @property
    def skipped(self) -> int:
        """How many clusters are left out on this visit."""
        return sum(stop.state is ClusterState.SKIPPED for stop in self.stops)

    @property
    def settled(self) -> bool:
        """Whether every cluster was accepted or skipped."""
        return all(stop.state in SETTLED_STATES for stop in self.stops)

    def stop(self, tag_id: int) -> Stop | None:
        """The stop of this tag; None where the route has none."""
        return next((stop for stop in self.stops if stop.tag_id == tag_id), None)

    def next_tag(self, after: int | None = None) -> int | None:
        """The next tag that needs a picture, from here to the end and round; None: all done."""
        tags = [stop.tag_id for stop in self.stops]
        start = tags.index(after) + 1 if after in tags else 0
        ordered = self.stops[start:] + self.stops[:start]
        return next((stop.tag_id for stop in ordered if stop.state in OPEN_STATES), None)

    def progress(self, tag_id: int) -> Progress | None:
        """ "Tree 4 of 10, cluster 3 of 7"; None where the route does not have the tag."""
        here = self.stop(tag_id)
        if here is None:
            return None
        trees = list(dict.fromkeys(stop.tree for stop in self.stops))
        same = [stop.tag_id for stop in self.stops if stop.tree == here.tree]
        return Progress(trees.index(here.tree) + 1, len(trees), same.index(tag_id) + 1, len(same))


def walk_route(database: Database, visit: EntryId) -> WalkRoute:
    """The route of a visit with the state of each cluster."""
    block = row_of(database, "visit", visit)["block"]
    captures = _captures_by_tag(database, visit)
    skipped = _skipped_turns(database, visit)
    stops = []
    for place in _places(database, block):
        taken = captures.get(place["tag_id"], [])
        state = _state(taken, skipped.get(place["tag_id"], 0))
        ids = tuple(row["id"] for row in taken)
        stops.append(Stop(place["tag_id"], place["tree"], place["label"] or "", state, ids))
    return WalkRoute(block, visit, tuple(stops), is_planned(database, block))


def is_planned(database: Database, block: EntryId) -> bool:
    """Whether the order in which a block is walked was given."""
    return bool(rows(database, "SELECT 1 FROM route_now WHERE block = ?", block))


def expectation(database: Database, visit: EntryId, tag_id: int) -> Expectation:
    """What is known about a cluster from the last day on which it was accepted.

    Fruitlets that were hidden then are alive, so they are expected now.
    """
    here = row_of(database, "visit_now", visit)
    found = rows(
        database,
        "SELECT visit.id,"
        " max((SELECT living FROM count_now WHERE capture = capture.id)) AS living"
        " FROM visit_now AS visit JOIN capture_now AS capture ON capture.visit = visit.id"
        " WHERE visit.block = ? AND visit.day < ? AND capture.tag_id = ?"
        " AND capture.id IN (SELECT capture FROM tag_candidate WHERE tag_id = ?)"
        " AND capture.action = 'accept' GROUP BY visit.id ORDER BY visit.day DESC LIMIT 1",
        here["block"],
        here["day"],
        tag_id,
        tag_id,
    )
    if not found:
        return Expectation(tag_id)
    return Expectation(tag_id, found[0]["living"] + _hidden(database, found[0]["id"], tag_id))


def _hidden(database: Database, visit: EntryId, tag_id: int) -> int:
    sql = (
        "SELECT coalesce(sum(count), 0) AS hidden FROM fruitlet_mark_now"
        " WHERE visit = ? AND tag_id = ? AND mark = 'hidden'"
    )
    return int(rows(database, sql, visit, tag_id)[0]["hidden"])


def _places(database: Database, block: EntryId) -> list[dict[str, Any]]:
    """Tag, tree and label in walking order: the planned route, then what was learned since."""
    clusters = rows(
        database,
        "SELECT cluster.tag_id, cluster.tree, tree.label, cluster.turn FROM cluster_now AS cluster"
        " LEFT JOIN tree ON tree.id = cluster.tree WHERE cluster.block = ? ORDER BY cluster.turn",
        block,
    )
    planned = rows(database, "SELECT tag_ids, turn FROM route_now WHERE block = ?", block)
    known = {cluster["tag_id"]: cluster for cluster in clusters}
    tags = list(dict.fromkeys(json.loads(planned[0]["tag_ids"]))) if planned else []
    since = planned[0]["turn"] if planned else 0
    unknown: dict[str, Any] = {"tree": None, "label": None}
    places = [known.get(tag, {"tag_id": tag, **unknown}) for tag in tags]
    for learned in clusters:
        if learned["turn"] > since and learned["tag_id"] not in tags:
            places.insert(_after_its_tree(places, learned["tree"]), learned)
    return places


def _after_its_tree(places: list[dict[str, Any]], tree: EntryId | None) -> int:
    """Where a tag that was learned later is walked: with its tree, or at the end."""
    same = [index for index, place in enumerate(places) if place["tree"] == tree]
    return same[-1] + 1 if same else len(places)


def _captures_by_tag(database: Database, visit: EntryId) -> dict[int, list[dict[str, Any]]]:
    found = rows(
        database,
        "SELECT id, tag_id, action, reading, turn,"
        " (SELECT status FROM reading WHERE id = capture_now.reading) AS status FROM capture_now"
        " WHERE visit = ? AND tag_id IS NOT NULL AND action IS NOT 'discard' ORDER BY turn",
        visit,
    )
    by_tag: dict[int, list[dict[str, Any]]] = {}
    for row in found:
        by_tag.setdefault(row["tag_id"], []).append(row)
    return by_tag


def _skipped_turns(database: Database, visit: EntryId) -> dict[int, int]:
    sql = (
        "SELECT tag_id, max(turn) AS turn FROM skip JOIN standing USING (id)"
        " WHERE visit = ? GROUP BY tag_id"
    )
    return {row["tag_id"]: row["turn"] for row in rows(database, sql, visit)}


def _state(taken: list[dict[str, Any]], skipped_turn: int) -> ClusterState:
    """The last word: skipping after a picture counts, and a picture after skipping."""
    if not taken or skipped_turn > taken[-1]["turn"]:
        return ClusterState.SKIPPED if skipped_turn else ClusterState.TODO
    last = taken[-1]
    if last["action"] == "accept":
        return ClusterState.ACCEPTED
    if last["action"] == "retake" or last["status"] == Status.RETAKE:
        return ClusterState.RETAKE
    return ClusterState.UNDECIDED if last["reading"] else ClusterState.WAITING
