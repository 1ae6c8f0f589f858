"""The Set-up screen: every line by keys and by mouse, and the way to the walk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import date, timedelta
from functools import partial
from pathlib import Path

import pytest
from made_states import AIM
from screens import LARGE, SMALL, Driven, check_golden, drive
from stored_walks import FIRST_DAY, small_store
from textual.geometry import Offset
from textual.widgets import Input, OptionList

from fieldcam.errors import BadInput, StorageFull
from fieldcam.session.aim.automatic import Automatic
from fieldcam.session.commands import Shoot, WriteNote
from fieldcam.session.events import DayDoubted
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.session.set_up.today import AnotherDay
from fieldcam.store.connection import rows
from fieldcam.store.queries.blocks import VisitSummary
from fieldcam.store.queries.blocks import visits as visits_of
from fieldcam.store.rows.orchard import Block, Setting
from fieldcam.store.space import Space
from fieldcam.store.store import Store
from fieldcam.tui.questions import answers
from fieldcam.tui.screens.setup_screen import SetUpScreen
from fieldcam.tui.screens.walk_screen import WalkScreen
from fieldcam.tui.text.setup_telling import Subject
from fieldcam.tui.widgets.buttons import BigButton

SIZES = pytest.mark.parametrize("size", [SMALL, LARGE], ids=["80x24", "120x40"])
BLOOM, TARGET = Setting.BLOOM_CLUSTERS_PER_TREE, Setting.TARGET_FRUIT_PER_TREE


class Clock:
    """Says a day."""

    def __init__(self) -> None:
        self.day = FIRST_DAY

    def __call__(self) -> date:
        return self.day


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Store]:
    monkeypatch.setattr(Space, "free_bytes", 72_000_000_000)
    with small_store(tmp_path / "data") as opened:
        yield opened


@pytest.fixture
def setup(store: Store, clock: Clock) -> SetUp:
    return SetUp(store, clock)


@pytest.fixture
def north(setup: SetUp) -> SetUp:
    """Ana walks block North today."""
    setup.sign_in("Ana")
    setup.new_block(Block("North", "Home", "Gala", 2026))
    setup.open_visit(FIRST_DAY)
    return setup


async def choose(driven: Driven, subject: Subject) -> None:
    """Press Enter on a line."""
    options = driven.app.screen.query_one(OptionList)
    options.highlighted = options.get_option_index(subject.name)
    await driven.press("enter")


@SIZES
def test_what_is_set_up_is_seen(north: SetUp, size: tuple[int, int]) -> None:
    north.set_trees(10)
    north.set_number(BLOOM, 120)
    north.set_number(BLOOM, 95, north.state().trees[1].id)
    north.set_number(TARGET, 40)
    north.add_spray(FIRST_DAY - timedelta(days=2), "Brevis", "2.2 kg/ha")

    async def script(driven: Driven) -> None:
        await driven.press("e")
        check_golden(f"setup-{size[0]}x{size[1]}", driven.text)

    drive(size, script, setup=north)


def test_the_first_start_is_set_up_by_keys(setup: SetUp) -> None:
    async def script(driven: Driven) -> None:
        await driven.press("o", "l", "escape")
        assert "Choose a block first, or make one." in driven.text
        await choose(driven, Subject.OPERATOR)
        await driven.type("Ana")
        assert "Ana walks." in driven.text
        await choose(driven, Subject.BLOCK)
        for text in ("North", "Home", "Gala", "2026"):
            await driven.type(text)
        assert "season    Home, Gala, 2026" in driven.text
        await driven.press("escape")
        assert isinstance(driven.app.screen, WalkScreen)

    assert drive(SMALL, script, setup=setup).started == 1
    assert setup.visit is not None


def test_every_line_is_changed_and_undone(north: SetUp, tmp_path: Path) -> None:
    route = tmp_path / "route.csv"
    route.write_text("tree,tag\n1,5\n1,6\n2,8\n")

    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.TREES)
        await driven.type("2")
        await choose(driven, Subject.BLOOM)
        await driven.press("end", "enter")
        await driven.type("120")
        await choose(driven, Subject.BLOOM)
        await driven.press("home", "enter")
        await driven.type("95,5")
        await choose(driven, Subject.TARGET)
        await driven.type("40")
        await choose(driven, Subject.SPRAYS)
        for text in ("2026-05-19", "Brevis", "2.2 kg/ha"):
            await driven.type(text)
        await choose(driven, Subject.ROUTE)
        await driven.type(str(route))
        for expected in (
            "Trees                       2",
            "120   1 counted by themselves",
            "should carry  40",
            "1, last 2026-05-19  Brevis  2.2 kg/ha",
            "planned, 3 tags",
            "The route has 3 tags in 2 trees.",
        ):
            assert expected in driven.text
        await driven.press(*"uuu")
        assert "learned by walking, 0 tags so far" in driven.text
        assert "Sprays                      none" in driven.text
        assert "should carry  not known" in driven.text

    drive(SMALL, script, setup=north)


def test_what_a_block_is_can_be_corrected(north: SetUp, store: Store) -> None:
    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.FACTS)
        for text in ("Home", "Fuji", "2025", "misread"):
            await driven.type(text)
        assert "season    Home, Fuji, 2025" in driven.text
        await driven.press("u")
        assert "Undone: the block's facts." in driven.text
        assert "season    Home, Gala, 2026" in driven.text

    drive(SMALL, script, setup=north)
    sql = "SELECT variety, why, name FROM block_facts JOIN entry USING (id) JOIN operator"
    (row,) = rows(store.database, f"{sql} ON operator.id = entry.who")
    assert row == {"variety": "Fuji", "why": "misread", "name": "Ana"}


def test_a_spray_that_was_none_is_struck_out(north: SetUp) -> None:
    north.add_spray(FIRST_DAY, "Mistake", "")

    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.SPRAYS)
        assert "2026-05-21  Mistake   (Enter, then Y, strikes it out)" in driven.text
        await driven.press("home", "enter", "enter")
        assert "Strike out 2026-05-21  Mistake?" in driven.text
        await driven.press("y")
        assert "The spray was struck out." in driven.text

    drive(SMALL, script, setup=north)
    assert north.state().sprays == ()


def test_what_is_typed_wrongly_stays_with_a_sentence(north: SetUp) -> None:
    before = north.state()

    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.TREES)
        await driven.type("none")
        assert "none is no whole number." in driven.text
        await driven.press("escape")
        assert isinstance(driven.app.screen, SetUpScreen)

    drive(SMALL, script, setup=north)
    assert north.state() == before


def test_a_form_says_what_enter_does_and_checks_a_field_that_is_left(north: SetUp) -> None:
    sentence = "Write the day as year-month-day"

    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.SPRAYS)
        assert "NEXT  Enter" in driven.text and "TAKE IT  Enter" not in driven.text
        await driven.press("x", "enter")
        assert sentence in driven.text
        await driven.type("2026-05-20")
        await driven.press("down")
        assert sentence not in driven.text
        assert "TAKE IT  Enter" in driven.text and "NEXT  Enter" not in driven.text

    drive(SMALL, script, setup=north)


def test_a_bad_route_keeps_its_question_open(north: SetUp, tmp_path: Path) -> None:
    route = tmp_path / "route.csv"
    route.write_text("tree,tag\n1,5\n1,5\n")

    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.ROUTE)
        await driven.type(str(tmp_path / "nowhere.csv"))
        assert "There is no table" in driven.text
        await driven.type(str(route))
        assert "route.csv, line 3: tag 5 is in line 2 already." in driven.text
        assert driven.app.screen.query_one(Input).value == str(route)
        route.write_text("tree,tag\n1,5\n1,6\n")
        await driven.press("enter")
        assert "planned, 2 tags" in driven.text

    drive(SMALL, script, setup=north)


WRONG: list[tuple[Callable[[str], object], str, str]] = [
    (answers.count, "", "Nothing is no whole number."),
    (answers.count, "2.5", "2.5 is no whole number."),
    (partial(answers.count, least=1, most=9), "10", "It must be between 1 and 9."),
    (partial(answers.count, least=1, most=9), "-1", "It must be between 1 and 9."),
    (partial(answers.count, least=1, most=9), "9" * 5000, "It must be between 1 and 9."),
    (answers.number, "-3", "It must be between 0 and 1000000."),
    (answers.number, "1e300", "It must be between 0 and 1000000."),
    (answers.number, "inf", "It must be between 0 and 1000000."),
    (answers.number, "nan", "nan is no number."),
    (answers.file, " ", "Give the name of a file."),
    (partial(answers.name, what="The block"), "  ", "The block needs a name."),
    (partial(answers.name, what="The block"), "x" * 61, "The block: at most 60 letters."),
    (answers.day, "19.5.", "Write the day as year-month-day, such as 2026-05-19."),
]


@pytest.mark.parametrize(("read", "text", "sentence"), WRONG)
def test_what_is_no_answer_is_said(read: Callable[[str], object], text: str, sentence: str) -> None:
    with pytest.raises(BadInput) as found:
        read(text)
    assert str(found.value) == sentence


def test_what_is_there_already_is_said_while_the_question_is_open(north: SetUp) -> None:
    north.set_trees(10)

    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.TREES)
        await driven.type("4")
        assert "The block has 10 trees already." in driven.text and "How many" in driven.text
        await driven.type("12")
        assert "The block has 12 trees." in driven.text and "How many" not in driven.text
        await choose(driven, Subject.BLOCK)
        await driven.press("end", "enter")
        for text in ("North", "", "", "2026"):
            await driven.type(text)
        assert "There is a block North already" in driven.text and "Season" in driven.text

    drive(SMALL, script, setup=north)


def test_all_of_it_by_mouse(north: SetUp) -> None:
    async def script(driven: Driven) -> None:
        await driven.press("e")
        row = list(Subject).index(Subject.TREES)
        await driven.pilot.click("#subjects", offset=Offset(5, 1 + row))
        await driven.settle()
        assert "How many trees" in driven.text
        await driven.press("4")
        await click(driven, "TAKE IT")
        assert "The block has 4 trees." in driven.text
        await click(driven, "UNDO")
        assert "Undone: the trees." in driven.text
        await click(driven, "CHANGE")
        await click(driven, "BACK")
        await click(driven, "TO THE WALK")
        assert isinstance(driven.app.screen, WalkScreen)

    drive(SMALL, script, setup=north)


async def click(driven: Driven, label: str) -> None:
    """On the big button of this label."""
    buttons = driven.app.screen.query(BigButton)
    await driven.pilot.click(next(each for each in buttons if label in str(each.label)))
    await driven.settle()


def test_set_up_is_reached_from_everywhere_but_a_question(north: SetUp) -> None:
    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        for keys in ("", "o", "l"):
            await driven.press(*keys, "e")
            assert "Everything may wait." in driven.text
            await driven.press("e")
            assert "aim, press Space" in driven.text
        await driven.press("e", "o")
        assert "Enter goes there." in driven.text
        await driven.press("escape", "n", "e")
        assert "A note on this picture" in driven.text

    drive(SMALL, script, setup=north)


def test_another_block_is_another_walk(north: SetUp) -> None:
    north.new_block(Block("South"))
    north.choose_block("North")
    north.open_visit(FIRST_DAY)

    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.BLOCK)
        await driven.press("home", "down", "enter", "escape")
        assert isinstance(driven.app.screen, WalkScreen)
        assert (driven.started, driven.walk.asked) == (2, ["close"])

    drive(SMALL, script, setup=north)


def test_an_operator_is_asked_for_once_and_never_needed(setup: SetUp, store: Store) -> None:
    setup.new_block(Block("North"))
    setup.open_visit(FIRST_DAY)

    async def script(driven: Driven) -> None:
        assert "Who walks?" in driven.text
        await driven.press("escape", "space")
        assert driven.walk.asked == [Shoot()]

    drive(SMALL, script, setup=setup)
    assert store.operator is None


@pytest.mark.parametrize(
    ("keys", "day"),
    [
        (("y",), date(2026, 5, 14)),
        (("n", "2026-05-24"), date(2026, 5, 24)),
        (("n", "escape"), date(2026, 5, 14)),
    ],
)
def test_a_clock_set_back_is_asked_about(
    north: SetUp, store: Store, clock: Clock, keys: tuple[str, ...], day: date
) -> None:
    clock.day = date(2026, 5, 14)
    setup = SetUp(store, clock)
    setup.resume()

    async def script(driven: Driven) -> None:
        assert "The clock says 14 May 2026, but the last visit was on 21 May 2026." in " ".join(
            driven.text.split()
        )
        for key in keys:
            await (driven.type(key) if "-" in key else driven.press(key))
        assert isinstance(driven.app.screen, WalkScreen)
        assert ("as the clock says. Set-up" in driven.text) == (keys[-1] == "escape")

    drive(SMALL, script, setup=setup)
    assert [visit.day for visit in visits(store, setup)] == sorted([FIRST_DAY, day])


def test_a_flat_clock_battery_is_asked_about_on_a_first_walk(
    setup: SetUp, store: Store, clock: Clock
) -> None:
    clock.day = date(2000, 1, 1)
    setup.sign_in("Ana")
    setup.new_block(Block("North"))

    async def script(driven: Driven) -> None:
        assert "before this version of fieldcam was made" in " ".join(driven.text.split())
        await driven.press("enter", "space")
        assert driven.started == 0
        await driven.press("n")
        await driven.type("2026-05-23")
        assert isinstance(driven.app.screen, WalkScreen)

    drive(SMALL, script, setup=setup)
    assert [visit.day for visit in visits(store, setup)] == [date(2026, 5, 23)]


def test_a_walk_that_outlives_its_day_is_asked_about(
    north: SetUp, store: Store, clock: Clock
) -> None:
    """Whether a picture is asked for or not; other keys than the answers do nothing."""
    north.sign_in("Ana")

    async def script(driven: Driven) -> None:
        clock.day = FIRST_DAY + timedelta(days=4)
        await driven.tell(AIM, DayDoubted(AnotherDay(FIRST_DAY, clock.day)))
        driven.app._look_at_the_calendar()
        await driven.settle()
        question = "This walk is of 21 May 2026, and the clock says 25 May 2026 now."
        assert question in " ".join(driven.text.split())
        await driven.press("enter", "space", "n")
        assert "The visit goes on. Set-up (E) corrects the days of visits." in driven.text
        driven.app._look_at_the_calendar()
        await driven.settle()
        assert isinstance(driven.app.screen, WalkScreen)
        clock.day += timedelta(days=1)
        assert AIM.tag_id is not None
        driven.app.automatic = Automatic(True, {AIM.tag_id})
        driven.app._look_at_the_calendar()
        await driven.settle()
        await driven.press("y")
        assert isinstance(driven.app.screen, WalkScreen)
        assert driven.app.automatic.on and driven.app.automatic.may(AIM)
        assert (driven.started, driven.walk.asked) == (2, ["close"])

    drive(SMALL, script, setup=north)
    assert [visit.day for visit in visits(store, north)] == [FIRST_DAY, date(2026, 5, 26)]


def test_the_calendar_takes_no_letters_from_what_is_typed(north: SetUp, clock: Clock) -> None:
    north.sign_in("Ana")

    async def script(driven: Driven) -> None:
        await driven.tell(AIM)
        await driven.press("n")
        clock.day = FIRST_DAY + timedelta(days=4)
        driven.app._look_at_the_calendar()
        await driven.press(*"any", "enter")
        assert driven.walk.asked == [WriteNote("any")]

    drive(SMALL, script, setup=north)


def test_the_size_of_the_cards_is_set_up(north: SetUp) -> None:
    """A walk that has begun begins anew: its previews are looked at for other cards."""

    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.TAGS)
        await driven.type("3")
        assert "A tag's black square has sides of 5 to 200 mm." in driven.text
        await driven.type("30")
        assert "Side of a tag's square, mm  30" in driven.text
        await driven.press("escape")
        assert isinstance(driven.app.screen, WalkScreen)
        assert (driven.started, driven.walk.asked) == (2, ["close"])

    drive(SMALL, script, setup=north)
    assert north.state().number(Setting.TAG_SIZE_MM) == 30.0


def test_the_day_of_a_visit_is_corrected(north: SetUp, store: Store) -> None:
    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.VISITS)
        assert "2026-05-21  0 pictures" in driven.text
        await driven.press("enter")
        for text in ("2026-05-19", "a flat battery"):
            await driven.type(text)
        assert "The visit of 21 May 2026 was on 19 May 2026." in driven.text
        assert "Days of its visits          1, last 2026-05-19, 1 corrected" in driven.text
        await choose(driven, Subject.VISITS)
        assert "2026-05-19  0 pictures   was 2026-05-21 (Ana): a flat" in driven.text

    north.sign_in("Ana")
    drive(SMALL, script, setup=north)
    assert [visit.day for visit in visits(store, north)] == [date(2026, 5, 19)]


def visits(store: Store, setup: SetUp) -> tuple[VisitSummary, ...]:
    assert setup.block is not None
    return visits_of(store.database, setup.block)


def test_what_the_start_up_check_found_is_read_first(north: SetUp) -> None:
    found = [
        "Image files that are missing: 2, of tag 11 of 21 May 2026.",
        "The disk is nearly full.",
    ]

    async def script(driven: Driven) -> None:
        assert all(sentence in driven.text for sentence in found)
        await driven.press("space")
        assert isinstance(driven.app.screen, WalkScreen)
        await driven.tell(AIM)
        await driven.press("l")
        assert all(sentence in driven.text for sentence in found)

    assert drive(SMALL, script, setup=north, lines=found).walk.asked == []


def test_a_full_disk_is_said(north: SetUp, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise StorageFull("No room is left.")

    async def script(driven: Driven) -> None:
        await driven.press("e")
        await choose(driven, Subject.TREES)
        with monkeypatch.context() as patch:
            patch.setattr(Store, "append", full)
            await driven.type("3")
        assert "NOT SAVED: No room is left." in driven.text

    drive(SMALL, script, setup=north)


def test_a_small_window_says_so(north: SetUp) -> None:
    async def script(driven: Driven) -> None:
        await driven.press("e")
        assert "fieldcam needs a window of 80x24" in " ".join(driven.text.split())

    drive((40, 10), script, setup=north)
