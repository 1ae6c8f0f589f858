"""`fieldcam growth` of a stored block, and the page that it writes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from called_commands import Capture, assert_one_sentence, run
from checked_pages import words_of
from grown_walks import DAYS, LATER_DAYS, grown_field, photograph
from planned_blocks import Measuring, measured_block
from stored_walks import MadeWalk, raw_pair, small_store

from fieldcam.errors import ExitCode
from fieldcam.exchange.calipers.wide import wide_table
from fieldcam.growth.records import SizeSource
from fieldcam.session.over_days.days import block_days, cluster_days
from fieldcam.simulator.plan import BlockPlan as PlannedBlock
from fieldcam.store.rows.judgements import Action, Decision
from fieldcam.store.rows.orchard import Block


@pytest.fixture
def field(tmp_path: Path) -> Path:
    return grown_field(tmp_path / "field")


@pytest.mark.parametrize(
    ("options", "persist"),
    [([], 5), (["--block", "North"], 5), (["--associate", "size-order"], 8)],
    ids=["newest", "named", "by size order"],
)
def test_a_stored_block_is_forecast(
    capsys: Capture, field: Path, options: list[str], persist: int
) -> None:
    code, out, _ = run(capsys, "growth", "--data", field, "--json", *options)
    found = json.loads(out)
    assert code == ExitCode.OK
    assert (found["block"], found["from"], found["to"]) == ("North", *map(str, DAYS))
    assert (found["initial"], found["persist"]) == (8, persist)
    assert found["notes"] == []


SECOND_VIEWS = {
    "larger": (12.4, 9.3, 9.9, 9.2),
    "smaller": (11.6, 8.7, 9.1, 8.5),
    "mixed": (12.4, 8.7, 9.9, 8.5),
    "unsized": (12.4, None, 9.9, None),
    "more": (12.4, 9.3, 9.9, 9.2, 7.7, 8.1),
    "fewer": (12.4, 9.3, 9.9),
}


@pytest.mark.parametrize("name", SECOND_VIEWS)
def test_block_and_cluster_have_the_sizes_behind_the_forecast(
    capsys: Capture, field: Path, name: str
) -> None:
    """Two pictures of one visit: each fruitlet's larger size, on the screens as in growth."""
    with small_store(field) as store:
        walk = MadeWalk(store)
        photograph(walk, walk.visit(LATER_DAYS), 11, SECOND_VIEWS[name])
        (block,) = block_days(store.database, walk.block)[1:]
        of_clusters = [cluster_days(store.database, walk.block, tag)[1] for tag in (11, 12)]
    _, out, _ = run(capsys, "growth", "--data", field, "--json")
    day = str(DAYS[1])
    sizes = sorted(
        each["sizes_mm"][day] for each in json.loads(out)["fruitlets"] if day in each["sizes_mm"]
    )
    assert list(block.sizes_mm) == pytest.approx(sizes, abs=0.005)
    shown = sorted(size for each in of_clusters for size in each.sizes_mm)
    assert shown == list(block.sizes_mm)
    assert [len(each.counted) for each in of_clusters] == [2, 1]
    assert of_clusters[0].fruitlets == len(of_clusters[0].sizes_mm)


def test_without_a_name_it_is_the_newest_block_with_two_visits(
    capsys: Capture, field: Path
) -> None:
    with small_store(field) as store:
        store.visit(store.block(Block("South, upper", "Home", "Gala", 2026)), DAYS[1])
        store.block(Block("East", "Home", "Gala", 2026))
    _, out, err = run(capsys, "growth", "--data", field, "--json")
    assert json.loads(out)["block"] == "North"
    assert 'Of 3 blocks this is "North"; --block names another.' in err
    assert "2 of 2 clusters" in err
    refused = run(capsys, "growth", "--data", field, "--block", "West")
    assert 'Blocks: "East", "North", "South, upper".' in refused[2]


def test_pictures_that_wait_to_be_read_are_told(capsys: Capture, field: Path) -> None:
    with small_store(field) as store:
        walk = MadeWalk(store)
        visit = walk.visit(LATER_DAYS)
        discarded = [walk.take(visit, tag).key for tag in (21, 21, 22, 22)][-1]
        store.append(Decision(discarded, Action.DISCARD))
        store.save(raw_pair(99), visit=walk.visit(LATER_DAYS + 3), tag_expected=None)
    _, out, _ = run(capsys, "growth", "--data", field, "--json")
    told = {each["code"]: each["text"] for each in json.loads(out)["warnings"]}
    assert told["unread_pictures"].startswith("Pictures of 3 clusters are stored and not read (2")


def test_pictures_that_nobody_accepted_are_told(capsys: Capture, field: Path) -> None:
    with small_store(field) as store:
        walk = MadeWalk(store)
        visit = walk.visit(LATER_DAYS)
        for tag in (12, 21, 21, 22):
            walk.read(walk.take(visit, tag).key, tag)
        turned_down = walk.take(visit, 23).key
        walk.read(turned_down, 23)
        store.append(Decision(turned_down, Action.DISCARD))
    _, out, _ = run(capsys, "growth", "--data", field, "--json")
    told = {each["code"]: each["text"] for each in json.loads(out)["warnings"]}
    assert told["undecided_pictures"].startswith(
        "Pictures of 2 clusters are stored and read, but not accepted (2 on"
    )


def test_the_page_shows_each_cluster_with_its_picture(
    capsys: Capture, field: Path, tmp_path: Path
) -> None:
    page = tmp_path / "north.html"
    code, _, err = run(capsys, "growth", "--data", field, "--report", page)
    assert code == ExitCode.OK and str(page) in err
    text = page.read_text()
    assert text.count("data:image/jpeg;base64,") == 2
    assert "Fruit set of North" in words_of(text)
    assert "The cluster at tag 12" in text


def test_a_page_can_be_had_without_the_pictures_files(
    capsys: Capture, field: Path, tmp_path: Path
) -> None:
    for file in (field / "objects").rglob("*.pgm"):
        file.unlink()
    page = tmp_path / "north.html"
    code, _, _ = run(capsys, "growth", "--data", field, "--report", page)
    assert code == ExitCode.OK
    assert "data:image" not in page.read_text()


def test_a_caliper_table_has_a_page_too(capsys: Capture, tmp_path: Path) -> None:
    table = tmp_path / "gala.csv"
    record = measured_block(
        PlannedBlock.plan(61, 20), Measuring(SizeSource.CALIPERS, (0, 4, 8)), 61
    )
    table.write_text(wide_table(record))
    page = tmp_path / "gala.html"
    plan = ("--bloom-clusters", 100, "--target", 1, "--sprayed", "2026-05-11")
    code, _, _ = run(capsys, "growth", "--calipers", table, *plan, "--report", page)
    assert code == ExitCode.OK
    text = words_of(page.read_text())
    assert "Fruit set of gala" in text and "thin again" in text and "spray 11 May" in text


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--block", "South"], 'Blocks: "North".'),
        (["--target", "50"], "--target goes with --calipers"),
        (["--report", "page.pdf"], "must end in .html"),
        (["--report", "nowhere/page.html"], "nowhere"),
        (["--associate", "magic"], "magic"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_cannot_be_forecast_is_told_in_one_sentence(
    capsys: Capture, field: Path, options: list[str], says: str
) -> None:
    done = run(capsys, "growth", "--data", field, *options)
    assert_one_sentence(*done, ExitCode.BAD_INPUT)
    assert says in done[2]


def test_a_block_without_visits_is_told(capsys: Capture, tmp_path: Path) -> None:
    folder = tmp_path / "new"
    with small_store(folder) as store:
        MadeWalk(store)
    assert_one_sentence(*run(capsys, "growth", "--data", folder), ExitCode.BAD_INPUT)


def test_a_day_without_a_visit_is_told_after_the_clusters_were_followed(
    capsys: Capture, field: Path
) -> None:
    code, out, err = run(capsys, "growth", "--data", field, "--from", "2026-05-20")
    assert (code, out) == (ExitCode.BAD_INPUT, "")
    assert err.splitlines()[-1].startswith("fieldcam: Block North was not measured on 2026-05-20.")
