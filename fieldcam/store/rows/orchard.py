"""Rows about what is walked: operators, blocks, trees, clusters, routes, sprays."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from enum import StrEnum
from typing import ClassVar

from fieldcam.store.rows.row import EntryId, Row, same
from fieldcam.store.rows.subjects import OfBlock


class Setting(StrEnum):
    """A number that the grower gives for a block or one of its trees."""

    TARGET_FRUIT_PER_TREE = "target_fruit_per_tree"
    """How many apples each tree should carry."""
    BLOOM_CLUSTERS_PER_TREE = "bloom_clusters_per_tree"
    """How many flower clusters were counted."""
    TAG_SIZE_MM = "tag_size_mm"
    """Side of the black square of the block's cards."""


@dataclass(frozen=True, slots=True)
class Device(Row):
    """One installation of fieldcam; its rows are counted together."""

    table: ClassVar[str] = "device"
    machine: str
    """Hash of the machine's id, so that a cloned disk is noticed."""
    name: str


@dataclass(frozen=True, slots=True)
class Operator(Row):
    """Someone who walks."""

    table: ClassVar[str] = "operator"
    name: str


@dataclass(frozen=True, slots=True)
class Block(Row):
    """One variety of one orchard in one season."""

    table: ClassVar[str] = "block"
    name: str
    orchard: str = ""
    variety: str = ""
    season: int = 0
    """The calendar year; 0 where unknown."""


@dataclass(frozen=True, slots=True)
class BlockFacts(Row):
    """Corrects what the block's own row says; its name stays."""

    table: ClassVar[str] = "block_facts"
    named: ClassVar[str] = "the block's facts"
    about: ClassVar[OfBlock] = OfBlock()
    key: ClassVar[str] = same("block")
    block: EntryId
    orchard: str
    variety: str
    season: int


@dataclass(frozen=True, slots=True)
class Tree(Row):
    """A tree of a block."""

    table: ClassVar[str] = "tree"
    named: ClassVar[str] = "the trees"
    about: ClassVar[OfBlock] = OfBlock()
    block: EntryId
    label: str


@dataclass(frozen=True, slots=True)
class Cluster(Row):
    """Tag `tag_id` of the block hangs in this tree; the last such row counts."""

    table: ClassVar[str] = "cluster"
    named: ClassVar[str] = "the place on the route"
    about: ClassVar[OfBlock] = OfBlock()
    key: ClassVar[str] = same("block", "tag_id")
    block: EntryId
    tag_id: int
    tree: EntryId | None = None


@dataclass(frozen=True, slots=True)
class Route(Row):
    """The order in which a block is to be walked; clusters learned later follow it."""

    table: ClassVar[str] = "route"
    named: ClassVar[str] = "the route"
    about: ClassVar[OfBlock] = OfBlock()
    key: ClassVar[str] = same("block")
    block: EntryId
    tag_ids: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class BlockSetting(Row):
    """A number for a block, or for one tree."""

    table: ClassVar[str] = "block_setting"
    named: ClassVar[str] = "the number"
    about: ClassVar[OfBlock] = OfBlock()
    key: ClassVar[str] = same("block", "tree", "name")
    block: EntryId
    name: Setting
    value: float
    tree: EntryId | None = None


@dataclass(frozen=True, slots=True)
class Spray(Row):
    """A thinning spray."""

    table: ClassVar[str] = "spray"
    named: ClassVar[str] = "the spray"
    about: ClassVar[OfBlock] = OfBlock()
    block: EntryId
    sprayed_on: date
    product: str
    rate: str = ""
    """As the operator wrote it, with its unit."""
