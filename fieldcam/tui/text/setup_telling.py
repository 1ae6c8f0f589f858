"""What the Set-up screen says of a block, one line for each thing; no widgets."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from fieldcam.session.set_up.setting_up import SetUpState, TreeFacts
from fieldcam.store.queries.blocks import BlockSummary, DayCorrection, SprayRecord, VisitSummary
from fieldcam.store.rows.orchard import Setting
from fieldcam.values import TAG_SIZE_MM
from fieldcam.words import number_of

WIDTH = 28
"""Columns of the names."""
UNKNOWN = "not known"


class Subject(StrEnum):
    """What a line is about, by its name on the screen."""

    OPERATOR = "Operator"
    BLOCK = "Block"
    FACTS = "Orchard, variety, season"
    TAGS = "Side of a tag's square, mm"
    TREES = "Trees"
    BLOOM = "Bloom clusters on a tree"
    TARGET = "Apples a tree should carry"
    SPRAYS = "Sprays"
    VISITS = "Days of its visits"
    ROUTE = "Route"


@dataclass(frozen=True, slots=True)
class Line:
    """One line; a dead one waits for a block."""

    subject: Subject
    text: str
    alive: bool


def lines(state: SetUpState) -> tuple[Line, ...]:
    """All lines, from top to bottom."""
    values = {
        Subject.OPERATOR: state.operator or UNKNOWN,
        Subject.BLOCK: UNKNOWN if state.block is None else state.block.name,
        Subject.FACTS: UNKNOWN if state.block is None else facts_line(state.block),
        Subject.TAGS: _tags(state),
        Subject.TREES: str(len(state.trees)) if state.trees else UNKNOWN,
        Subject.BLOOM: _bloom(state),
        Subject.TARGET: _number(state.number(Setting.TARGET_FRUIT_PER_TREE)),
        Subject.SPRAYS: _sprays(state),
        Subject.VISITS: _visits(state),
        Subject.ROUTE: _route(state),
    }
    return tuple(
        Line(
            subject,
            f" {subject:<{WIDTH}}{value}",
            _alive(state, subject),
        )
        for subject, value in values.items()
    )


def facts_line(block: BlockSummary) -> str:
    """What is known of a block."""
    season = str(block.season) if block.season else ""
    return ", ".join(filter(None, [block.orchard, block.variety, season])) or UNKNOWN


def visit_line(visit: VisitSummary, correction: DayCorrection | None = None) -> str:
    """With what it was before, who said so and why."""
    line = f"{visit.day}  {number_of(visit.captures, 'picture')}"
    if correction is None:
        return line
    who, why = correction.who and f" ({correction.who})", correction.why and f": {correction.why}"
    return f"{line}   was {correction.given}{who}{why}"


def spray_line(spray: SprayRecord) -> str:
    return f"{spray.sprayed_on}  {spray.product}  {spray.rate}".rstrip()


def tree_line(tree: TreeFacts) -> str:
    return f"tree {tree.label}: {_number(tree.bloom_clusters)}"


def _number(value: float | None) -> str:
    return UNKNOWN if value is None else f"{value:g}"


def _bloom(state: SetUpState) -> str:
    common = state.number(Setting.BLOOM_CLUSTERS_PER_TREE)
    own = sum(tree.bloom_clusters not in (None, common) for tree in state.trees)
    return f"{_number(common)}   {own} counted by themselves" if own else _number(common)


def _sprays(state: SetUpState) -> str:
    if not state.sprays:
        return "none"
    return f"{len(state.sprays)}, last {spray_line(state.sprays[-1])}"


def _tags(state: SetUpState) -> str:
    """As long as nobody says otherwise the cards are the usual ones."""
    said = state.number(Setting.TAG_SIZE_MM)
    return f"{TAG_SIZE_MM:g}, the usual ones" if said is None else f"{said:g}"


def _alive(state: SetUpState, subject: Subject) -> bool:
    """Without a block, or a visit, there is nothing to say of it."""
    if subject is Subject.VISITS:
        return bool(state.visits)
    return state.block is not None or subject in (Subject.OPERATOR, Subject.BLOCK)


def _visits(state: SetUpState) -> str:
    if not state.visits:
        return "none"
    corrected = f", {len(state.corrections)} corrected" if state.corrections else ""
    return f"{len(state.visits)}, last {state.visits[-1].day}{corrected}"


def _route(state: SetUpState) -> str:
    clusters = 0 if state.block is None else state.block.clusters
    if state.planned:
        return f"planned, {number_of(clusters, 'tag')}"
    return f"learned by walking, {number_of(clusters, 'tag')} so far"
