"""U on a cluster's own screens takes back words on its fruitlets, and nothing else."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from stored_walks import MadeWalk, small_store

from fieldcam.growth.places import MatchWord, Place
from fieldcam.session.commands import (
    AddByHand,
    CrownKing,
    GoTo,
    MatchFruit,
    NameFruit,
    Strike,
    UndoFruit,
    UndoMatch,
    Writing,
)
from fieldcam.session.deciding.decide import decide
from fieldcam.session.doubt import NotNow
from fieldcam.session.viewing import WalkView
from fieldcam.store.connection import rows
from fieldcam.store.rows.row import EntryId


class Cluster:
    """Tag 11 on two days, and tag 12 beside it; all accepted on the second visit's walk."""

    def __init__(self, made: MadeWalk) -> None:
        self.store = made.store
        first = made.visit()
        self.visit = made.visit(3)
        self.pictures = [made.accept(day, tag) for tag in (11, 12) for day in (first, self.visit)]
        self._view = WalkView(self.store, self.visit)

    def do(self, command: Writing) -> str:
        return decide(self._view, command)

    def match(self, tag_id: int, fruitlet: int) -> None:
        at = 2 * (tag_id - 11)
        one, other = (self._reading(capture) for capture in self.pictures[at : at + 2])
        self.do(MatchFruit(MatchWord(Place(one, fruitlet), Place(other, fruitlet))))

    def standing(self) -> list[str]:
        kinds = "'decision', 'association_word', 'caliper_size', 'caliper_identity'"
        marks = f"{kinds}, 'fruitlet_mark'"
        sql = f"SELECT kind FROM standing WHERE kind IN ({marks}) ORDER BY turn"
        return [row["kind"] for row in rows(self.store.database, sql)]

    def _reading(self, capture: EntryId) -> EntryId:
        sql = "SELECT reading FROM capture_now WHERE id = ?"
        reading: EntryId = rows(self.store.database, sql, capture)[0]["reading"]
        return reading


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    with small_store(tmp_path) as store:
        yield Cluster(MadeWalk(store))


def test_only_matches_of_this_cluster_are_taken_back(cluster: Cluster) -> None:
    before = cluster.standing()
    cluster.match(11, 0)
    cluster.match(11, 1)
    cluster.match(12, 0)
    cluster.do(NameFruit(cluster.pictures[1], 2, "fl3", 9.5))

    told = [cluster.do(UndoMatch(11)) for _ in range(2)]
    assert told == ["Undone: the match on tag 11."] * 2
    with pytest.raises(NotNow, match="No match of tag 11 is left to undo here"):
        cluster.do(UndoMatch(11))
    left = ["association_word", "caliper_identity", "caliper_size"]
    assert cluster.standing() == [*before, *left]


def test_names_sizes_and_the_king_are_taken_back_and_no_decision(cluster: Cluster) -> None:
    before = cluster.standing()
    picture, other = cluster.pictures[1], cluster.pictures[3]
    said_of: list[Writing] = [
        NameFruit(other, 1, "fl9"),
        NameFruit(picture, 2, "fl3", 9.5),
        CrownKing(picture, 0),
        AddByHand(picture, 8.0),
        GoTo(11),
        Strike(3),
    ]
    for command in said_of:
        cluster.do(command)
    told = [cluster.do(UndoFruit(11)) for _ in range(3)]
    assert told == [
        "Undone: the mark on tag 11.",
        "Undone: the mark on tag 11.",
        "Undone: the fruit's name and the caliper size on tag 11.",
    ]
    with pytest.raises(NotNow, match="No size, name or king of tag 11 is left"):
        cluster.do(UndoFruit(11))
    assert cluster.standing() == [*before, "caliper_identity", "fruitlet_mark"]
