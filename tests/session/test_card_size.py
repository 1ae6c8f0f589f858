"""The size of a block's cards: set up once, and used by whatever sees them."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import cast

import pytest
from called_commands import Capture, run
from made_evidence import evidence, in_right, judged, make_tag
from made_readings import CAMERA, made_reading
from recorded_pairs import AtOnce, Encoding
from stored_walks import FIRST_DAY, MadeWalk, small_store

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.work import DirectAnalyst
from fieldcam.app.rig import with_cards_of
from fieldcam.cli.card_size import tag_size_of
from fieldcam.errors import ExitCode
from fieldcam.session.importing import ImportTerms, import_pairs
from fieldcam.session.over_days.growing import cluster_rows, followed_cluster
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.store.connection import rows
from fieldcam.store.queries.blocks import block_named, settings, tag_size_mm
from fieldcam.store.read_only import open_read_only
from fieldcam.store.rows.orchard import Block, BlockSetting, Setting
from fieldcam.store.store import Store
from fieldcam.values import (
    TAG_SIZE_MM,
    Calibration,
    ClusterReading,
    Expectation,
    Settings,
    StereoPair,
)
from fieldcam.vision.pipeline import Pipeline


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with small_store(tmp_path / "data") as opened:
        yield opened


def size_in(data: Path, block: str) -> float | None:
    """What is set up; None where nothing is."""
    with closing(open_read_only(data)) as found:
        known = block_named(found.database, block)
        assert known is not None
        return settings(found.database, known.id).get(Setting.TAG_SIZE_MM)


class Noting:
    """A pipeline that only notes the size of the cards."""

    def __init__(self) -> None:
        self.sizes_mm: list[float] = []

    def analyse(
        self,
        pair: StereoPair,
        calibration: Calibration,
        expectation: Expectation,
        settings: Settings,
    ) -> ClusterReading:
        self.sizes_mm.append(settings.tag_size_mm)
        return made_reading()


def test_a_picture_is_read_with_the_cards_of_its_block(store: Store) -> None:
    """As they are set up when it is read, whoever has it read."""
    walk, noting = MadeWalk(store), Noting()
    other = store.visit(store.block(Block("South")), FIRST_DAY)
    pictures = [walk.take(walk.visit(), 11), walk.take(other, 11)]
    analyst = DirectAnalyst(cast(Pipeline, noting), CAMERA, Settings())
    for size_mm in (30.0, 32.5):
        store.append(BlockSetting(walk.block, Setting.TAG_SIZE_MM, size_mm))
        for picture in pictures:
            analyst.analyse(picture, Expectation())
    assert noting.sizes_mm == [30.0, TAG_SIZE_MM, 32.5, TAG_SIZE_MM]


def test_cards_that_were_taken_for_others_are_followed_as_what_they_are(store: Store) -> None:
    """Their range is by their size; what was read is kept as it is."""
    walk = MadeWalk(store)
    walk.accept(walk.visit(), 11)
    before = cluster_rows(store.database, walk.block, 11)
    store.append(BlockSetting(walk.block, Setting.TAG_SIZE_MM, 2 * TAG_SIZE_MM))
    after = cluster_rows(store.database, walk.block, 11)
    assert after != before, "it is followed anew"
    near, far = (
        followed_cluster(store.database, each).visits[0].views[0].reading.tag
        for each in (before, after)
    )
    assert near is not None and far is not None
    assert near.range_mm is not None and far.range_mm == 2 * near.range_mm


def test_previews_are_looked_at_for_the_cards_of_the_block(store: Store) -> None:
    setup, walk = SetUp(store, lambda: FIRST_DAY), MadeWalk(store)
    setup.block = walk.block
    setup.open_visit(FIRST_DAY)
    assert setup.visit is not None
    before = setup.walked
    setup.set_number(Setting.TAG_SIZE_MM, 30.0)
    assert setup.walked != before, "another walk begins"
    found = with_cards_of(Setup(None), store.database, setup.visit)
    assert found.settings.tag_size_mm == 30.0
    setup.undo()
    assert setup.walked == before and tag_size_mm(store.database, walk.block) == TAG_SIZE_MM


def test_printing_the_cards_of_a_block_sets_their_size_up(tmp_path: Path, capsys: Capture) -> None:
    data = tmp_path / "data"

    def printed(name: str, *options: object) -> float:
        out = tmp_path / f"{name}.pdf"
        argv = ("--data", data, "tags-print", out, "--count", "2", "--block", "North", "--json")
        code, told, _ = run(capsys, *argv, *options)
        assert code == ExitCode.OK
        size_mm: float = json.loads(told)["tag_size_mm"]
        return size_mm

    assert (printed("usual"), size_in(data, "North")) == (TAG_SIZE_MM, None)
    assert (printed("large", "--tag-size-mm", "30"), size_in(data, "North")) == (30.0, 30.0)
    assert printed("more") == 30.0, "the size that is set up"


def test_an_import_sets_it_up_once(store: Store) -> None:
    analyst = Encoding(DirectAnalyst(cast(Pipeline, Noting()), CAMERA, Settings()))
    for _ in range(2):
        assert (
            list(
                import_pairs(
                    store, Block("North"), AtOnce(analyst), [], ImportTerms(tag_size_mm=30.0)
                )
            )
            == []
        )
    assert len(rows(store.database, "SELECT id FROM block_setting")) == 1
    assert size_in(store.folder.path, "North") == 30.0


@pytest.mark.parametrize(
    ("said_mm", "block", "counts_mm"),
    [(None, None, TAG_SIZE_MM), (None, "North", 30.0), (25.0, "North", 25.0), (25.0, None, 25.0)],
)
def test_one_pair_is_sized_with_the_cards_of_its_block(
    store: Store, said_mm: float | None, block: str | None, counts_mm: float
) -> None:
    walk = MadeWalk(store)
    store.append(BlockSetting(walk.block, Setting.TAG_SIZE_MM, 30.0))
    arguments = Namespace(tag_size_mm=said_mm, block=block, data=store.folder.path)
    assert tag_size_of(arguments) == counts_mm


def test_cards_that_cannot_be_printed_set_nothing_up(tmp_path: Path, capsys: Capture) -> None:
    data, out = tmp_path / "data", tmp_path / "tags.pdf"
    argv = ("--data", data, "tags-print", out, "--block", "North", "--tag-size-mm", "900")
    assert run(capsys, *argv)[0] == ExitCode.BAD_INPUT
    with closing(open_read_only(data)) as found:
        assert block_named(found.database, "North") is None


@pytest.mark.parametrize(("size_mm", "told"), [("30", True), (str(TAG_SIZE_MM), False)])
def test_cards_of_no_block_are_told_to_be_set_up(
    tmp_path: Path, capsys: Capture, size_mm: str, told: bool
) -> None:
    _, _, err = run(capsys, "tags-print", tmp_path / "tags.pdf", "--tag-size-mm", size_mm)
    assert ("--block NAME" in err) == told


@pytest.mark.parametrize(
    ("wider", "code"), [(30 / TAG_SIZE_MM - 1, "calibration_drift"), (0.25, "mispaired")]
)
def test_a_card_of_another_size_is_told_as_what_it_may_be(wider: float, code: str) -> None:
    """Not only as eyes that have moved, which no calibration cures."""
    (reason,) = judged(evidence(right_tag=in_right(make_tag(), wider=wider))).reasons
    assert reason.code == code
    measured_mm = TAG_SIZE_MM * (1 + wider + 0.0055)
    assert reason.text.startswith(
        f"The tag measures {measured_mm:.1f} mm, and is set up as 27.95 mm: correct the size of"
    )
    right = evidence(right_tag=in_right(make_tag(), wider=wider), tag_size_mm=measured_mm)
    assert judged(right).reasons == ()
