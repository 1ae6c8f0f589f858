"""Caliper sizes typed at a tag: a fruitlet is picked by key or mouse, then measured."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from screens import LARGE, SMALL, Driven, drive
from stored_walks import FIRST_DAY, MadeWalk, small_store
from textual.widgets import Input

from fieldcam.growth.agreement import Agreement
from fieldcam.session.commands import NameFruit
from fieldcam.session.events import Done
from fieldcam.session.state import WalkState
from fieldcam.session.viewing import WalkView
from fieldcam.store.rows.fruit import CaliperIdentity, CaliperSize
from fieldcam.tui.looks import Look, PictureStyle
from fieldcam.tui.text.fruit_words import agreement_line
from fieldcam.tui.widgets.picture_view import PictureView
from fieldcam.tui.widgets.sizes_view import SizesView
from fieldcam.tui.widgets.sketch import Still
from fieldcam.words import letter_of

SIZES = pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])


@dataclass
class AtTag:
    """The operator stands at tag 11, whose picture shows five fruitlets."""

    made: MadeWalk
    state: WalkState
    capture: str
    reading: str


@pytest.fixture
def at_tag(tmp_path: Path) -> Iterator[AtTag]:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        visit = made.visit()
        capture = made.accept(visit, 11)
        view = WalkView(store, visit)
        state = replace(view.state(), tag_id=11, shown=view.shown(11, view.route()))
        found = next(store.database.query("SELECT id FROM reading WHERE capture = ?", [capture]))
        yield AtTag(made, state, capture, found["id"])


def chosen(driven: Driven) -> int | None:
    return driven.app.screen.query_one(SizesView).chosen


def test_a_fruitlet_is_picked_by_key_and_measured(at_tag: AtTag) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(at_tag.state)
        await driven.press("v", "down", "down", "c")
        assert "Fruitlet C by caliper:" in driven.text
        await driven.type("9,25")
        await driven.type("fl3")
        await driven.press("down", "c", "enter")
        await driven.type("fl4")
        await driven.press("c")
        for leave in ("enter", "down"):
            driven.app.screen.query(Input).first().value = "9.x"
            await driven.press(leave)
            assert "9.x is no number." in driven.text
            wrong = driven.app.screen.query(Input).first()
            assert wrong.has_focus and wrong.has_class("-wrong")
        await driven.type("9.5")
        assert "is no number" not in driven.text and not wrong.has_class("-wrong")
        assert driven.app.screen.query(Input).last().has_focus
        await driven.press("escape")
        assert not driven.app.screen.query(Input)

    assert drive(SMALL, script).walk.asked == [
        NameFruit(at_tag.capture, 2, "fl3", 9.25),
        NameFruit(at_tag.capture, 3, "fl4", None),
    ]


def test_without_a_picture_there_is_nothing_to_measure(at_tag: AtTag) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(replace(at_tag.state, tag_id=12))
        await driven.press("v")
        for key in ("c", "m", "k", "left"):
            await driven.tell(Done("Something else."))
            await driven.press(key)
            assert driven.text.count("There is no picture of this cluster yet.") == 2
            assert not driven.app.screen.query(Input)

    assert drive(SMALL, script).walk.asked == []


def test_names_sizes_and_agreement_are_shown(at_tag: AtTag) -> None:
    store, block = at_tag.made.store, at_tag.made.block

    async def script(driven: Driven) -> None:
        await driven.tell(at_tag.state)
        await driven.press("v")
        assert "by caliper" not in driven.text
        store.append(
            CaliperIdentity(at_tag.reading, 1, "fl3"),
            CaliperIdentity(at_tag.reading, 2, "fl4"),
            CaliperSize(block, 11, FIRST_DAY, "fl3", 10.25),
        )
        await driven.tell(at_tag.state)
        assert 'B  10.00 mm "fl3" 10.25' in driven.text and 'C  11.00 mm "fl4" ' in driven.text
        assert "Camera less caliper, 1 fruitlet: -0.25 mm; measure 19 more" in driven.text
        assert "picture 1: fruitlet C" in driven.text
        await driven.press("down", "c")
        assert driven.app.screen.query(Input).last().value == "fl3"

    drive(SMALL, script)


@pytest.mark.parametrize(
    "found, words",
    [
        (None, ""),
        (
            Agreement(1, 0.1, None),
            "Camera less caliper, 1 fruitlet: +0.10 mm; measure 19 more to judge by it",
        ),
        (
            Agreement(20, -0.12, 0.25),
            "Camera less caliper, 20 fruitlets: -0.12 mm, spread 0.25, 95 % -0.61 to +0.37",
        ),
    ],
)
def test_agreement_in_words(found: Agreement | None, words: str) -> None:
    assert agreement_line(found) == words
    assert len(words) <= 78


@SIZES
@pytest.mark.parametrize("pictures", [PictureStyle.BLOCKS, PictureStyle.CELLS])
@pytest.mark.parametrize("screen", ["Walk", "Cluster"])
def test_a_click_on_a_fruitlet_picks_it(
    at_tag: AtTag, size: tuple[int, int], pictures: PictureStyle, screen: str
) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(at_tag.state)
        if screen == "Cluster":
            await driven.press("v")
        assert driven.text.startswith(f" {screen}")
        view = driven.app.screen.query_one(PictureView)
        assert chosen(driven) == 0
        columns, rows = view.CELL_PX
        width, height = view.size.width * columns, view.size.height * rows
        sketch = view._sketch
        assert isinstance(sketch, Still)
        labels = sketch.paint((width, height)).labels
        for label in (labels[3], labels[1]):
            offset = (int(label.x / columns), int(label.y / rows))
            await driven.pilot.click(PictureView, offset=offset)
            await driven.settle()
            found = chosen(driven)
            assert found is not None and letter_of(found) == label.text
        before = chosen(driven)
        await driven.pilot.click(PictureView, offset=(0, 0))
        assert chosen(driven) == before

    drive(size, script, Look(pictures))
