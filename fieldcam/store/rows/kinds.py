"""All kinds of rows, as their classes say them."""

from __future__ import annotations

from fieldcam.store.rows import fruit, judgements, orchard, walk
from fieldcam.store.rows.row import Row
from fieldcam.store.rows.subjects import OfBlock, OfCluster

KINDS: tuple[type[Row], ...] = tuple(
    kind
    for module in (orchard, walk, judgements, fruit)
    for kind in vars(module).values()
    if isinstance(kind, type) and issubclass(kind, Row) and kind is not Row
)
KIND_OF = {kind.table: kind for kind in KINDS}
"""By their tables."""
WORDS: dict[type[Row], OfCluster] = {
    kind: kind.about for kind in KINDS if isinstance(kind.about, OfCluster)
}
"""Kinds that say something of a cluster, and what they are about."""
SET_UP: dict[type[Row], OfBlock] = {
    kind: kind.about for kind in KINDS if isinstance(kind.about, OfBlock)
}
"""Kinds that say how a block is set up."""
