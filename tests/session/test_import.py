"""Recorded pairs reach the store whole, once, and in their place, however often one tries."""

from __future__ import annotations

import hashlib
import os
import random
import signal
import time
from collections import Counter
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from made_readings import made_reading
from recorded_pairs import (
    HEIGHT,
    WIDTH,
    AtOnce,
    Encoding,
    FakeAnalyst,
    write_calibration,
    write_image,
    write_pairs,
)
from stored_walks import raw_pair, small_store

from fieldcam.analysis.work import DirectAnalyst
from fieldcam.codec.readings import EncodedReading
from fieldcam.errors import (
    AnalysisFailed,
    AnalysisOff,
    AnalysisTimeout,
    CalibrationInvalid,
    StorageError,
)
from fieldcam.exchange.capture_folder import read_capture_folder
from fieldcam.exchange.images import read_image
from fieldcam.session.importing import ImportTerms, Outcome, import_pairs
from fieldcam.session.intake import Fate
from fieldcam.store.captures import SavedCapture
from fieldcam.store.connection import rows
from fieldcam.store.folder import DataKind
from fieldcam.store.queries.blocks import blocks, visits
from fieldcam.store.queries.history import cluster_history
from fieldcam.store.queries.resuming import resume, saved_capture, waiting_for_analysis
from fieldcam.store.recovery.integrity import full_check, rehash
from fieldcam.store.recovery.startup import startup_check
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.orchard import Block
from fieldcam.store.store import Store, open_store
from fieldcam.values import (
    Calibration,
    ClusterReading,
    Expectation,
    Settings,
    Status,
    StereoPair,
)
from fieldcam.vision.pipeline import Pipeline

THREE = ("2026-05-21/17_1", "2026-05-21/18_1", "2026-05-25/17_1")


def run(
    store: Store, folder: Path, analyst: FakeAnalyst | Encoding, block: str = "North"
) -> list[Outcome]:
    found = read_capture_folder(folder).captures
    return list(import_pairs(store, Block(block), AtOnce(analyst), found))


def fates(outcomes: list[Outcome]) -> Counter[str]:
    return Counter(str(outcome.fate) for outcome in outcomes)


def entries(store: Store) -> int:
    return int(rows(store.database, "SELECT count(*) AS n FROM entry")[0]["n"])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_pairs(tmp_path / "season", THREE)


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return small_store(tmp_path / "data")


def test_each_pair_lies_under_its_day_block_and_tag(store: Store, folder: Path) -> None:
    analyst = FakeAnalyst()
    outcomes = run(store, folder, analyst)
    assert fates(outcomes) == {"added": 3}
    assert {outcome.status for outcome in outcomes} == {Status.ACCEPT}
    (block,) = blocks(store.database)
    assert (block.name, block.clusters, block.visits) == ("North", 2, 2)
    first, second = cluster_history(store.database, block.id, 17)
    assert [first.day, second.day] == [date(2026, 5, 21), date(2026, 5, 25)]
    assert (first.tag_expected, first.view, first.action) == (17, 1, Action.ACCEPT)
    assert analyst.asked[2][1] == Expectation(17, 3)
    assert [visit.accepted for visit in visits(store.database, block.id)] == [2, 1]
    names = {row["name"] for row in rows(store.database, "SELECT name FROM operator")}
    assert names == {"import"}


def test_files_and_calibration_are_kept_byte_for_byte(store: Store, folder: Path) -> None:
    day_own = write_calibration(folder / "2026-05-25" / "calibration.yml", 61.0)
    outcomes = run(store, folder, FakeAnalyst())
    for waiting, outcome in zip(captures(store), outcomes, strict=True):
        saved = saved_capture(store.database, waiting)
        assert saved is not None and saved.calibration is not None
        assert saved.left.read_bytes() == outcome.file.left.read_bytes()
        assert saved.right.read_bytes() == outcome.file.right.read_bytes()
        assert saved.calibration.read_bytes() == cast(Path, outcome.file.calibration).read_bytes()
    sql = "SELECT calibration FROM capture JOIN entry USING (id) ORDER BY turn"
    newest = rows(store.database, sql)[-1]["calibration"]
    assert store.objects.path(newest).read_bytes() == day_own.read_bytes()
    full_check(store.database)
    assert rehash(store.database, store.objects) == ()
    assert startup_check(store).sentences == ()


def captures(store: Store) -> list[str]:
    sql = "SELECT id FROM capture JOIN entry USING (id) ORDER BY turn"
    return [row["id"] for row in rows(store.database, sql)]


def test_a_second_run_adds_nothing(store: Store, folder: Path) -> None:
    run(store, folder, FakeAnalyst())
    before, analyst = entries(store), FakeAnalyst()
    outcomes = run(store, folder, analyst)
    assert fates(outcomes) == {"known": 3}
    assert (entries(store), analyst.asked) == (before, [])


def test_a_pair_without_a_reading_is_analysed_at_the_next_run(store: Store, folder: Path) -> None:
    failing = FakeAnalyst(error=AnalysisFailed("The analysis ended in the middle."))
    outcomes = run(store, folder, failing)
    assert fates(outcomes) == {"added": 3}
    assert all("not analysed" in outcome.problem for outcome in outcomes)
    before = entries(store)
    run(store, folder, failing)
    assert entries(store) == before
    assert {outcome.status for outcome in run(store, folder, FakeAnalyst())} == {Status.ACCEPT}
    assert waiting_for_analysis(store.database) == ()


def test_an_analysis_that_is_off_ends_the_run(store: Store, folder: Path) -> None:
    with pytest.raises(AnalysisOff):
        run(store, folder, FakeAnalyst(error=AnalysisOff("The analysis is off.")))
    assert len(captures(store)) == 1


def test_what_needs_a_retake_is_kept_and_not_accepted(store: Store, folder: Path) -> None:
    run(store, folder, FakeAnalyst(status=Status.RETAKE))
    assert rows(store.database, "SELECT * FROM decision") == []
    assert len(rows(store.database, "SELECT id FROM reading")) == 3


def test_an_imported_visit_is_over_and_a_walked_one_goes_on(store: Store, folder: Path) -> None:
    run(store, folder, FakeAnalyst())
    assert resume(store.database) is None
    block = store.block(Block("South"))
    walked = store.visit(block, date(2026, 5, 21))
    store.save(raw_pair(), visit=walked, tag_expected=3)
    south = write_pairs(folder.parent / "south", ["2026-05-21/4_1"], ".jpg")
    run(store, south, FakeAnalyst(), "South")
    found = resume(store.database)
    assert found is not None and found.visit == walked


def test_the_same_pictures_under_another_name_are_refused(store: Store, folder: Path) -> None:
    run(store, folder, FakeAnalyst())
    outcomes = run(store, folder, FakeAnalyst(), "South")
    assert fates(outcomes) == {"skipped": 3}
    assert outcomes[0].problem == (
        "17_1_left.png and 17_1_right.png are stored already, as tag 17 of 2026-05-21, block North."
    )
    for capture in captures(store):
        store.append(Decision(capture, Action.DISCARD))
    assert fates(run(store, folder, FakeAnalyst(), "South")) == {"added": 3}


def test_the_authors_tree_keeps_its_times(store: Store, tmp_path: Path) -> None:
    tree = tmp_path / "tree"
    for side, seed in (("LEFT", 1), ("RIGHT", 2)):
        write_image(tree / "17_2023-05-20-03-10-00" / "COLOR" / f"0_{side}.png", seed)
    write_calibration(tree / "2023_05_19.yml")
    assert fates(run(store, tree, FakeAnalyst())) == {"added": 1}
    (row,) = rows(store.database, "SELECT taken_at, day FROM capture JOIN visit"
                  " ON visit.id = capture.visit")  # fmt: skip
    assert row["taken_at"].startswith("2023-05-20T03:10:00")
    assert row["day"] == "2023-05-19"


Spoil = Callable[[Path], object]
SPOILT: dict[str, tuple[Spoil, str]] = {
    "empty": (lambda day: (day / "17_1_left.png").write_bytes(b""), "is empty"),
    "no image": (lambda day: (day / "17_1_left.png").write_text("hello"), "is no PNG"),
    "truncated": (
        lambda day: (day / "17_1_left.png").write_bytes((day / "18_1_left.png").read_bytes()[:99]),
        "is truncated",
    ),
    "sizes differ": (lambda day: write_image(day / "17_1_left.png", 7, (48, 62, 3)), "62 x 48"),
    "another camera's": (
        lambda day: [write_image(day / f"17_1_{s}.png", 7, (50, 64, 3)) for s in ("left", "right")],
        "its calibration 64 x 48",
    ),
    "gone": (lambda day: (day / "17_1_right.png").unlink(), ""),
}  # fmt: skip


@pytest.mark.parametrize(("spoil", "words"), SPOILT.values(), ids=SPOILT)
def test_bad_pairs_are_skipped_and_the_rest_is_not(
    store: Store, folder: Path, spoil: Spoil, words: str
) -> None:
    found = read_capture_folder(folder).captures
    spoil(folder / "2026-05-21")
    bad, *good = import_pairs(store, Block("North"), AtOnce(FakeAnalyst()), found)
    assert bad.fate is Fate.SKIPPED and words in bad.problem
    assert fates(good) == {"added": 2}
    assert len(captures(store)) == 2


def test_pairs_that_are_all_refused_make_no_block(store: Store, folder: Path) -> None:
    (folder / "calibration.yml").write_text("nonsense")
    assert fates(run(store, folder, FakeAnalyst())) == {"skipped": 3}
    assert blocks(store.database) == ()
    good = write_pairs(folder.parent / "good", THREE, ".jpg")
    run(store, good, FakeAnalyst())
    assert fates(run(store, good, FakeAnalyst(), "South")) == {"skipped": 3}
    assert [block.name for block in blocks(store.database)] == ["North"]


def test_a_calibration_that_is_none_spoils_its_day_only(store: Store, folder: Path) -> None:
    (folder / "2026-05-21" / "calibration.yml").write_text("nonsense")
    assert fates(run(store, folder, FakeAnalyst())) == {"skipped": 2, "added": 1}


class SeeingPipeline:
    """Remembers what it was given."""

    def __init__(self) -> None:
        self.seen: list[tuple[StereoPair, Calibration]] = []

    def analyse(
        self, pair: StereoPair, calibration: Calibration, expectation: Expectation, _: Settings
    ) -> ClusterReading:
        self.seen.append((pair, calibration))
        return made_reading(expectation=expectation)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".ppm", ".pgm"])
def test_the_analysis_reads_what_the_store_keeps(store: Store, tmp_path: Path, suffix: str) -> None:
    folder = write_pairs(tmp_path / "season", THREE[:1], suffix)
    pipeline = SeeingPipeline()
    analyst = DirectAnalyst(cast(Pipeline, pipeline), None, Settings())
    (outcome,) = run(store, folder, Encoding(analyst))
    ((pair, calibration),) = pipeline.seen
    np.testing.assert_array_equal(pair.left, read_image(outcome.file.left))
    np.testing.assert_array_equal(pair.right, read_image(outcome.file.right))
    assert calibration.width_px == WIDTH
    assert calibration.baseline_mm == pytest.approx(60.0)


def test_raw_pairs_are_rectified_by_their_own_file(store: Store, tmp_path: Path) -> None:
    folder = write_pairs(tmp_path / "season", THREE[:1])
    matrix, rotation = [80.0, 0, 32, 0, 80, 24, 0, 0, 1], [1.0, 0, 0, 0, 1, 0, 0, 0, 1]
    lines = [f"M{n}: {matrix}\nD{n}: [0.0, 0, 0, 0, 0]" for n in (1, 2)]
    lines += [f"R: {rotation}", "T: [-0.06, 0, 0]"]
    (folder / "calibration.yml").write_text("\n".join(lines))
    pipeline = SeeingPipeline()
    run(store, folder, Encoding(DirectAnalyst(cast(Pipeline, pipeline), None, Settings())))
    ((pair, calibration),) = pipeline.seen
    assert pair.size_px == (WIDTH, HEIGHT)
    assert calibration.baseline_mm == pytest.approx(60.0)


def test_a_pair_without_any_calibration_is_one_sentence(store: Store) -> None:
    saved = store.save(raw_pair())
    analyst = DirectAnalyst(cast(Pipeline, SeeingPipeline()), None, Settings())
    with pytest.raises(CalibrationInvalid, match="without a calibration"):
        analyst.analyse(saved, Expectation())


def test_what_a_crash_left_without_a_row_is_imported_all_the_same(
    store: Store, tmp_path: Path
) -> None:
    folder = write_pairs(tmp_path / "season", THREE[:1], ".ppm")
    (file,) = read_capture_folder(folder).captures
    for path in (file.left, file.right):
        store.objects.keep(path.read_bytes(), ".ppm")
    assert len(startup_check(store).taken_up.captures) == 1
    assert fates(run(store, folder, FakeAnalyst())) == {"added": 1}
    assert waiting_for_analysis(store.database) == ()
    assert fates(run(store, folder, FakeAnalyst())) == {"known": 1}


def import_apart(data: Path, folder: Path) -> int:
    """In a process of its own, which ends with 0 if all went well; gives its id."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            with small_store(data) as store:
                run(store, folder, FakeAnalyst())
            status = 0
        finally:
            os._exit(status)
    return child


def test_a_run_that_is_killed_is_gone_on_with(tmp_path: Path) -> None:
    stems = [f"2026-05-{day}/{tag}_1" for day in (21, 25) for tag in range(12)]
    folder, data = write_pairs(tmp_path / "season", stems, ".ppm"), tmp_path / "data"
    chance = random.Random(1)
    for _ in range(12):
        child = import_apart(data, folder)
        time.sleep(chance.uniform(0.01, 0.25))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        with small_store(data) as store:
            startup_check(store)
    with small_store(data) as store:
        run(store, folder, FakeAnalyst())
        counted = rows(
            store.database,
            "SELECT count(*) AS pairs, count(DISTINCT left_file) AS files FROM capture_now"
            " WHERE action = 'accept' AND reading IS NOT NULL",
        )
        assert counted == [{"pairs": 24, "files": 24}]
        assert fates(run(store, folder, FakeAnalyst())) == {"known": 24}
        full_check(store.database)
        assert rehash(store.database, store.objects) == ()


def test_two_runs_at_once_add_each_pair_once(tmp_path: Path) -> None:
    stems = [f"2026-05-21/{tag}_1" for tag in range(12)]
    folder, data = write_pairs(tmp_path / "season", stems), tmp_path / "data"
    small_store(data).close()
    children = [import_apart(data, folder) for _ in range(3)]
    assert [os.waitpid(child, 0)[1] for child in children] == [0, 0, 0]
    with small_store(data) as store:
        assert len(captures(store)) == 12
        assert blocks(store.database)[0].clusters == 12


def test_a_simulated_folder_takes_no_recorded_pairs(tmp_path: Path, folder: Path) -> None:
    with open_store(tmp_path / "demo", DataKind.SIMULATED) as demo:
        with pytest.raises(StorageError, match="simulated captures only"):
            run(demo, folder, FakeAnalyst())
        assert captures(demo) == [] and list(demo.objects.names()) == []


SUMS = {
    "SHA256SUMS": ("sha256", "{sum}  {name}"),
    "md5sums.txt": ("md5", "{sum} *./{name}"),
    "manifest-sha512.txt": ("sha512", "SHA512 ({name}) = {sum}"),
    "walk.sha1": ("sha1", "{sum}  {name}\r"),
}


@pytest.mark.parametrize("name", SUMS)
@pytest.mark.parametrize("place", ["", "2026-05-21", ".."])
def test_a_file_that_is_not_the_listed_one_is_skipped(
    store: Store, folder: Path, name: str, place: str
) -> None:
    algorithm, line = SUMS[name]
    beside = (folder / place).resolve()
    files = [path for path in sorted(folder.rglob("*.png")) if path.is_relative_to(beside)]
    lines = [
        line.format(
            sum=hashlib.new(algorithm, path.read_bytes()).hexdigest(),
            name=path.relative_to(beside),
        )
        for path in files
    ]
    (beside / name).write_text("\n".join(lines), newline="")
    write_image(folder / f"{THREE[0]}_left.png", 77)
    (folder / f"{THREE[1]}_left.png").unlink()
    (folder / f"{THREE[1]}_right.png").unlink()
    found = read_capture_folder(folder)
    assert [problem.text for problem in found.problems] == [
        f"18_1_{eye}.png is not here, and {name} lists it." for eye in ("left", "right")
    ]
    outcomes = list(
        import_pairs(
            store,
            Block("North"),
            AtOnce(FakeAnalyst()),
            found.captures,
            ImportTerms(found.checksums),
        )
    )
    assert fates(outcomes) == {"added": 1, "skipped": 1}
    assert outcomes[0].problem.startswith(f"17_1_left.png is not the file that {name} lists")


def test_the_good_original_mends_the_damaged_copy(store: Store, folder: Path) -> None:
    run(store, folder, FakeAnalyst())
    copy = saved_capture(store.database, captures(store)[0])
    assert copy is not None
    whole = copy.left.read_bytes()
    copy.left.write_bytes(whole[:100] + bytes(len(whole) - 100))
    outcomes = run(store, folder, FakeAnalyst())
    assert [(each.fate, each.mended) for each in outcomes] == [
        (Fate.KNOWN, 1),
        (Fate.KNOWN, 0),
        (Fate.KNOWN, 0),
    ]
    assert copy.left.read_bytes() == whole
    assert rehash(store.database, store.objects) == ()


class BusyAnalyst(FakeAnalyst):
    """Has no time for a pair at first."""

    def __init__(self, failures: int) -> None:
        super().__init__()
        self.failures = failures

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> EncodedReading:
        if self.failures:
            self.failures -= 1
            raise AnalysisTimeout("The analysis did not answer in time.")
        return super().analyse(saved, expectation)


def test_what_a_busy_machine_left_unread_is_tried_again(store: Store, folder: Path) -> None:
    outcomes = run(store, folder, BusyAnalyst(2))
    assert [outcome.file.tag_id for outcome in outcomes] == [17, 17, 18]
    assert {outcome.status for outcome in outcomes} == {Status.ACCEPT}
    assert rows(store.database, "SELECT * FROM analysis_failure") == []


def test_what_stays_unread_is_said(store: Store, folder: Path) -> None:
    outcomes = run(store, folder, BusyAnalyst(100))
    assert [outcome.unread for outcome in outcomes] == [True] * 3
    assert len(rows(store.database, "SELECT * FROM analysis_failure")) == 3
    assert fates(run(store, folder, FakeAnalyst())) == {"known": 3}
