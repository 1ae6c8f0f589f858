"""U on a cluster's own screens takes back words on its fruitlets, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fieldcam.session.deciding.undoing import undo_fruit, undo_match
from stored_walks import MadeWalk, small_store

from fieldcam.growth.places import Place, Word
from fieldcam.session.book import WalkBook
from fieldcam.session.doubt import NotNow
from fieldcam.session.fruit_book import FruitBook
from fieldcam.session.viewing import WalkView
from fieldcam.store.connection import rows
from fieldcam.store.rows import EntryId


class Cluster:
    """Tag 11 on two days, and tag 12 beside it; all accepted on the second visit's walk."""

    def __init__(self, made: MadeWalk) -> None:
        self.store = made.store
        first = made.visit()
        self.visit = made.visit(3)
        self.pictures = [made.accept(day, tag) for tag in (11, 12) for day in (first, self.visit)]
        view = WalkView(self.store, self.visit)
        self.book, self.fruit = WalkBook(view), FruitBook(view)

    def match(self, tag_id: int, fruitlet: int) -> None:
        at = 2 * (tag_id - 11)
        one, other = (self._reading(capture) for capture in self.pictures[at : at + 2])
        self.fruit.match(Word(Place(one, fruitlet), Place(other, fruitlet)))

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
    cluster.fruit.name_fruit(cluster.pictures[1], 2, "fl3", 9.5)

    def undo() -> str:
        return undo_match(cluster.store, cluster.visit, 11)

    assert [undo(), undo()] == ["Undone: the match on tag 11."] * 2
    with pytest.raises(NotNow, match="No match of tag 11 is left to undo here"):
        undo()
    left = ["association_word", "caliper_identity", "caliper_size"]
    assert cluster.standing() == [*before, *left]


def test_names_sizes_and_the_king_are_taken_back_and_no_decision(cluster: Cluster) -> None:
    before = cluster.standing()
    picture, other = cluster.pictures[1], cluster.pictures[3]
    said_of: list[Callable[[], str]] = [
        lambda: cluster.fruit.name_fruit(other, 1, "fl9", None),
        lambda: cluster.fruit.name_fruit(picture, 2, "fl3", 9.5),
        lambda: cluster.book.king(picture, 0),
        lambda: cluster.book.add_by_hand(picture, 8.0),
        lambda: cluster.book.go_to(11),
        lambda: cluster.book.strike(3),
    ]
    for say in said_of:
        say()
    told = [undo_fruit(cluster.store, cluster.visit, 11) for _ in range(3)]
    assert told == [
        "Undone: the mark on tag 11.",
        "Undone: the mark on tag 11.",
        "Undone: the fruit's name and the caliper size on tag 11.",
    ]
    with pytest.raises(NotNow, match="No size, name or king of tag 11 is left"):
        undo_fruit(cluster.store, cluster.visit, 11)
    assert cluster.standing() == [*before, "caliper_identity", "fruitlet_mark"]
