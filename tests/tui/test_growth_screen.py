"""The Growth screen: prediction, target, trend, warnings, and what drives them."""

from __future__ import annotations

import asyncio
import re
import threading
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path

import pytest
from made_readings import TAG, encoded, made_fruitlet, made_reading
from made_tracks import tracked_by_id
from screens import LARGE, SMALL, Driven, check_golden, drive
from stored_walks import FIRST_DAY, MadeWalk, small_store
from textual.widgets import OptionList

from fieldcam.growth.places import Association, Track
from fieldcam.growth.size_rule import SizeRule
from fieldcam.session.over_days.block_growth import block_outlook, crop_plan, known_clusters
from fieldcam.session.over_days.growing import FollowedCluster, block_rows
from fieldcam.session.state import WalkState
from fieldcam.session.viewing import WalkView
from fieldcam.store.readings import reading_row
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.orchard import BlockSetting, Setting, Spray
from fieldcam.store.space import Space
from fieldcam.tui.looks import Look, PictureStyle
from fieldcam.tui.text.growth_words import gauge, more_line

SIZES = pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])
DAYS = (0, 4, 8)


@dataclass
class Grown:
    """Four clusters of six on three visits; the smaller half has nearly stopped."""

    made: MadeWalk
    state: WalkState


def grow(made: MadeWalk, tag_id: int, day: int) -> None:
    """Fruitlet n measures 7 + n / 2 mm at first and gains n / 5 mm a day."""
    capture = made.take(made.visit(day), tag_id).key
    fruitlets = [
        made_fruitlet(n, (100.0 + 30 * n, 100.0), 7 + n / 2 + day * n / 5) for n in range(6)
    ]
    reading = made_reading(fruitlets, tag=replace(TAG, id=tag_id))
    made.store.append(
        reading_row(capture, encoded(reading), 400.0), Decision(capture, Action.ACCEPT)
    )


def by_id_or_half(
    cluster: FollowedCluster,
    method: Association = Association.GEOMETRY,
    size_rule: SizeRule | None = None,
) -> tuple[Track, ...]:
    """Size order finds half of the fruitlets only."""
    tracks = tracked_by_id(cluster)
    return tracks[3:] if method is Association.SIZE_ORDER else tracks


@pytest.fixture
def grown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Grown]:
    monkeypatch.setattr(Space, "free_bytes", 72_000_000_000)
    monkeypatch.setattr("fieldcam.session.over_days.block_growth.tracks_of", by_id_or_half)
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        for day in DAYS:
            for tag_id in made.tags:
                grow(made, tag_id, day)
        state = replace(WalkView(store, made.visit(8)).state(), tag_id=11, simulated=True)
        yield Grown(made, state)


def set_up(made: MadeWalk, bloom: float, target: float) -> None:
    made.store.append(
        BlockSetting(made.block, Setting.BLOOM_CLUSTERS_PER_TREE, bloom),
        BlockSetting(made.block, Setting.TARGET_FRUIT_PER_TREE, target),
        Spray(made.block, FIRST_DAY + timedelta(2), "Fruitone", "7.5 ppm"),
        Spray(made.block, FIRST_DAY + timedelta(30), "Too late", ""),
    )


@SIZES
def test_the_prediction_and_what_it_is_made_of(grown: Grown, size: tuple[int, int]) -> None:
    set_up(grown.made, bloom=40, target=70)

    async def script(driven: Driven) -> None:
        await driven.tell(grown.state)
        await driven.press("b", "g")
        check_golden(f"growth-{size[0]}x{size[1]}", driven.text)
        await driven.press("g")
        assert driven.text.startswith(" SIMULATED  Block")

    drive(size, script)


def test_targets_and_their_verdicts(grown: Grown) -> None:
    verdicts = {
        (40.0, 70.0): "more than the target of 70: thin again",
        (40.0, 150.0): "the target of 150 is within reach",
        (10.0, 200.0): "fewer than the target of 200: do not thin any more",
    }

    async def script(driven: Driven) -> None:
        await driven.tell(grown.state)
        await driven.press("b", "g")
        assert "Count bloom clusters (E)" in driven.text and "T" not in driven.text.splitlines()[5]
        for (bloom, target), words in verdicts.items():
            set_up(grown.made, bloom, target)
            await driven.tell(grown.state)
            assert words in driven.text
        assert "6 days after Fruitone" in driven.text

    drive(LARGE, script)


def test_size_order_far_away_is_warned_of(grown: Grown) -> None:
    set_up(grown.made, bloom=40, target=70)

    async def script(driven: Driven) -> None:
        await driven.tell(grown.state)
        await driven.press("b", "g")
        pages = [driven.text]
        assert re.search("PgDn: [0-9]+ more lines below", pages[0])
        while "PgDn" in pages[-1] and len(pages) < 12:
            await driven.press("pagedown")
            pages.append(driven.text)
        assert "PgUp: back up" in pages[-1] and "PgDn" not in pages[-1]
        assert "Matched by size order alone" in " ".join(pages[-1].split())
        await driven.press(*["pageup"] * len(pages))
        assert "Visit by visit" in driven.text

    drive(SMALL, script)


@SIZES
@pytest.mark.parametrize("visits", [0, 1])
def test_without_two_visits_there_is_no_forecast(
    tmp_path: Path, visits: int, size: tuple[int, int]
) -> None:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        for day in range(visits):
            grow(made, 11, day)
        state = WalkView(store, made.visit()).state()

        async def script(driven: Driven) -> None:
            await driven.tell(state)
            await driven.press("b", "g", "pagedown", "down")
            assert "No forecast yet" in driven.text and "growth needs two." in driven.text
            assert "PgDn" not in driven.text and "PgUp" not in driven.text
            again = "Measure it again at least 3 days later."
            twice = "Measure it twice, at least 3 days apart."
            assert (again if visits else twice) in " ".join(driven.text.split())
            await driven.pilot.resize_terminal(*LARGE)
            await driven.settle()
            assert "PgDn" not in driven.text
            await driven.tell(replace(state, folder=tmp_path / "gone"))
            assert "There is no database at" in driven.text

        drive(size, script)


def test_only_what_changed_is_followed_again(grown: Grown, monkeypatch: pytest.MonkeyPatch) -> None:
    followed: list[int] = []

    def counting(
        cluster: FollowedCluster, method: Association, size_rule: SizeRule | None
    ) -> tuple[Track, ...]:
        followed.append(cluster.tag_id)
        return tracked_by_id(cluster)

    monkeypatch.setattr("fieldcam.session.over_days.block_growth.tracks_of", counting)

    async def script(driven: Driven) -> None:
        await driven.tell(grown.state)
        await driven.press("b", "g")
        assert sorted(followed) == [11, 11, 12, 12, 21, 21, 22, 22]
        followed.clear()
        await driven.tell(grown.state)
        assert followed == []
        grow(grown.made, 12, 8)
        await driven.tell(grown.state)
        assert followed == [12, 12]
        followed.clear()
        await driven.press("g", "g")
        assert "will stay" in driven.text and followed == []

    drive(SMALL, script)


def test_a_cluster_of_the_list_is_opened(grown: Grown) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(grown.state)
        await driven.press("b", "g")
        listed = driven.app.screen.query_one(OptionList)
        tags = [listed.get_option_at_index(n).id for n in range(listed.option_count)]
        assert sorted(map(str, tags)) == ["11", "12", "21", "22"]
        await driven.press("down", "enter")
        assert driven.text.startswith(" SIMULATED  Cluster") and f"Tag {tags[1]} " in driven.text
        await driven.press("t")
        assert f"Tag {tags[1]} " in driven.text
        await driven.press("g")
        assert "will stay" in driven.text

    drive(SMALL, script)


def test_how_far_the_following_is(grown: Grown, monkeypatch: pytest.MonkeyPatch) -> None:
    reached, go_on = threading.Event(), threading.Event()

    def waiting(
        cluster: FollowedCluster, method: Association, size_rule: SizeRule | None
    ) -> tuple[Track, ...]:
        if cluster.tag_id == 21:
            reached.set()
            assert go_on.wait(10)
        return tracked_by_id(cluster)

    monkeypatch.setattr("fieldcam.session.over_days.block_growth.tracks_of", waiting)

    async def script(driven: Driven) -> None:
        await driven.tell(grown.state)
        try:
            await driven.pilot.press("b", "g")
            await asyncio.to_thread(reached.wait, 10)
            await driven.pilot.pause()
            assert "Following clusters from day to day, 2 of 4." in driven.text
            # Keys answer meanwhile.
            await driven.pilot.press("question_mark")
            assert "Any key closes this page." in driven.text
        finally:
            go_on.set()
        await driven.press("escape")
        assert "will stay" in driven.text

    drive(SMALL, script)


def test_what_is_below_or_above_is_said() -> None:
    assert [more_line(*lines) for lines in ((0, 0), (1, 0), (12, 3), (0, 3))] == [
        "",
        "PgDn: 1 more line below",
        "PgDn: 12 more lines below",
        "PgUp: back up",
    ]


def test_without_colours_it_says_the_same(grown: Grown) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(grown.state)
        await driven.press("b", "g")
        assert "of the first fruitlets will stay" in driven.text

    drive(SMALL, script, Look(PictureStyle.NONE, colour=False))


def test_bloom_is_the_mean_of_the_trees(grown: Grown) -> None:
    store, block = grown.made.store, grown.made.block
    assert crop_plan(store.database, block) is None
    store.append(BlockSetting(block, Setting.BLOOM_CLUSTERS_PER_TREE, 100))
    tree = store.tree(block, "tree 1")
    store.append(BlockSetting(block, Setting.BLOOM_CLUSTERS_PER_TREE, 60, tree))
    plan = crop_plan(store.database, block)
    assert plan is not None and (plan.bloom_clusters, plan.target_fruit) == (80, None)


def test_a_blocks_growth_out_of_its_store(grown: Grown) -> None:
    database, block = grown.made.store.database, grown.made.block
    known = list(known_clusters(database, block_rows(database, block), {}))
    growth = block_outlook(database, block, known)
    assert (growth.found.start.first, growth.found.end.first) == (
        FIRST_DAY + timedelta(4),
        FIRST_DAY + timedelta(8),
    )
    assert growth.found.counts.initial == 24 and growth.found.counts.not_seen == 0
    assert len(growth.trend) == 2 and len(growth.clusters) == 4
    assert {each.tree for each in growth.clusters} == {"tree 1", "tree 2"}


def test_the_bar_shows_prediction_interval_and_target() -> None:
    assert gauge(50, (25, 75), 90, 100, 21) == "─────[────█────]──T──"
    assert gauge(50, (25, 75), None, 100, 21) == "─────[────█────]─────"
    assert gauge(0, (0, 0), None, 0, 9) == "█────────"
    assert len(gauge(500, (-5, 900), 1000, 100, 30)) == 30
