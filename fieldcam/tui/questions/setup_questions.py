"""What each line of the Set-up screen asks, and which change the answer makes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from textual.app import App

from fieldcam import RELEASED
from fieldcam.errors import BadInput, FieldcamError
from fieldcam.exchange.route_table import read_route
from fieldcam.session import events
from fieldcam.session.set_up.setting_up import (
    MAX_TREES,
    SetUp,
    SetUpState,
    TreeFacts,
    check_new_block,
    check_trees,
)
from fieldcam.store.rows.orchard import Block, Setting
from fieldcam.store.rows.row import EntryId
from fieldcam.tui.questions import answers
from fieldcam.tui.questions.asking import AskYes
from fieldcam.tui.questions.forms import AskChoice, AskForm, Field
from fieldcam.tui.text.setup_telling import Subject, spray_line, tree_line, visit_line
from fieldcam.values import TAG_SIZE_MM

Change = Callable[[], str]
"""Writes something, and says what."""
SEASONS = (1900, 2200)
BLOOM, TARGET = Setting.BLOOM_CLUSTERS_PER_TREE, Setting.TARGET_FRUIT_PER_TREE


def carried_out(change: Change) -> events.LiveEvent:
    """What came of a change."""
    try:
        return events.Done(change())
    except BadInput as refusal:
        return events.Refused(str(refusal))
    except FieldcamError as error:
        return events.StorageTrouble(error)


@dataclass(frozen=True, slots=True)
class Questions:
    """Asks on top of the screen; `take` gets the change that was asked for."""

    app: App[None]
    setup: SetUp
    state: SetUpState
    take: Callable[[Change], object]

    def ask(self, subject: Subject) -> None:
        """Ask about one line."""
        {
            Subject.OPERATOR: self.operator,
            Subject.BLOCK: self.block,
            Subject.FACTS: self.facts,
            Subject.TAGS: self.tags,
            Subject.TREES: self.trees,
            Subject.BLOOM: self.bloom,
            Subject.TARGET: self.target,
            Subject.SPRAYS: self.sprays,
            Subject.VISITS: self.visits,
            Subject.ROUTE: self.route,
        }[subject]()

    def operator(self) -> None:
        known = self.state.operators

        def change(name: str) -> Change:
            return partial(self.setup.sign_in, answers.name(name, "The operator"))

        def someone_new() -> None:
            self._form("Who walks?", [Field("Name")], change)

        def known_one(index: int) -> None:
            self.take(change(known[index]))

        self._choose("Who walks?", known, "Someone new", known_one, someone_new)

    def block(self) -> None:
        known = self.state.blocks

        def known_one(index: int) -> None:
            self.take(partial(self.setup.choose_block, known[index]))

        def another() -> None:
            season = Field("Season (year)", str(max(self.state.day, RELEASED).year))
            fields = [Field("Name"), Field("Orchard"), Field("Variety"), season]
            self._form("A block is one variety of one orchard in one season.", fields, self._block)

        self._choose("Which block?", known, "A new block", known_one, another)

    def facts(self) -> None:
        if (block := self.state.block) is None:
            return
        fields = [
            Field("Orchard", block.orchard),
            Field("Variety", block.variety),
            Field("Season (year)", str(block.season or self.state.day.year)),
            Field("Why, if you like"),
        ]
        self._form(f"What block {block.name} is:", fields, self._facts)

    def tags(self) -> None:
        def change(size: str) -> Change:
            return partial(self.setup.set_number, Setting.TAG_SIZE_MM, answers.tag_size_mm(size))

        said = self.state.number(Setting.TAG_SIZE_MM) or TAG_SIZE_MM
        field = Field("Side in mm", f"{said:g}", answers.tag_size_mm)
        self._form("How long is a side of the black square on the block's cards?", [field], change)

    def trees(self) -> None:
        def change(count: str) -> Change:
            wanted = answers.count(count, 1, MAX_TREES)
            check_trees(wanted, len(self.state.trees))
            return partial(self.setup.set_trees, wanted)

        self._form("How many trees does the block have?", [Field("Trees")], change)

    def bloom(self) -> None:
        trees = self.state.trees

        def of_tree(index: int) -> None:
            tree = trees[index]
            self._number(f"Bloom clusters on tree {tree.label}?", BLOOM, tree)

        def of_every_tree() -> None:
            self._number("Bloom clusters on a tree, counted or estimated?", BLOOM)

        lines = [tree_line(tree) for tree in trees]
        self._choose("Bloom clusters", lines, "Every tree", of_tree, of_every_tree)

    def target(self) -> None:
        self._number("How many apples should a tree carry at harvest?", TARGET)

    def sprays(self) -> None:
        known = self.state.sprays

        def another() -> None:
            today = self.state.day.isoformat() if self.state.day >= RELEASED else ""
            day = Field("Day", today, answers.day)
            fields = [day, Field("Product"), Field("Rate, with its unit")]
            self._form("A thinning spray:", fields, self._spray)

        def strike(index: int) -> None:
            spray = known[index]

            def answered(yes: bool | None) -> None:
                if yes:
                    self.take(partial(self.setup.strike_spray, spray.id))

            self.app.push_screen(AskYes(f"Strike out {spray_line(spray)}?"), answered)

        lines = [f"{spray_line(spray)}   (Enter, then Y, strikes it out)" for spray in known]
        self._choose("Sprays", lines, "A new spray", strike, another)

    def visits(self) -> None:
        """Which one, and which day it was."""
        known, said = self.state.visits, self.state.corrections

        def chosen(index: int | None) -> None:
            if index is None:
                return
            visit = known[index]

            def change(day: str, why: str) -> Change:
                corrected = answers.day(day)
                return partial(self.setup.correct_day, visit.id, corrected, answers.words(why))

            fields = [
                Field("Day", visit.day.isoformat(), answers.day),
                Field("Why, if you like"),
            ]
            self._form(f"The visit of {visit.day} was on:", fields, change)

        lines = [visit_line(visit, said.get(visit.id)) for visit in known]
        self.app.push_screen(AskChoice("Which visit has the wrong day?", lines), chosen)

    def route(self) -> None:
        def change(path: str) -> Change:
            return partial(self.setup.plan_route, read_route(answers.file(path)))

        question = (
            "A table (CSV, .xlsx, .ods) with the columns tree and tag, in walking order."
            " Without one the route is learned by walking: the first picture of a tag adds it."
        )
        self._form(question, [Field("File")], change)

    def _block(self, name: str, orchard: str, variety: str, season: str) -> Change:
        block = Block(
            answers.name(name, "The block"),
            answers.words(orchard),
            answers.words(variety),
            answers.count(season, *SEASONS),
        )
        check_new_block(block.name, self.state.blocks)
        return partial(self.setup.new_block, block)

    def _facts(self, orchard: str, variety: str, season: str, why: str) -> Change:
        return partial(
            self.setup.correct_block,
            answers.words(orchard),
            answers.words(variety),
            answers.count(season, *SEASONS),
            answers.words(why),
        )

    def _spray(self, day: str, product: str, rate: str) -> Change:
        found = answers.name(product, "The product")
        return partial(self.setup.add_spray, answers.day(day), found, answers.words(rate))

    def _number(self, question: str, name: Setting, tree: TreeFacts | None = None) -> None:
        key: EntryId | None = None if tree is None else tree.id

        def change(text: str) -> Change:
            return partial(self.setup.set_number, name, answers.number(text), key)

        self._form(question, [Field("Number")], change)

    def _form(self, question: str, fields: Sequence[Field], make: Callable[..., Change]) -> None:
        def answered(change: Change | None) -> None:
            if change is not None:
                self.take(change)

        self.app.push_screen(AskForm(question, fields, make), answered)

    def _choose(
        self,
        question: str,
        lines: Sequence[str],
        other: str,
        chosen: Callable[[int], None],
        otherwise: Callable[[], None],
    ) -> None:
        """One of the lines, or the other thing, which comes at once where there are none."""

        def answered(index: int | None) -> None:
            if index is not None:
                otherwise() if index == len(lines) else chosen(index)

        if lines:
            self.app.push_screen(AskChoice(question, [*lines, other]), answered)
        else:
            otherwise()
