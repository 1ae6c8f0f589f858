"""The block that a command names."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from fieldcam.cli.console import narrate
from fieldcam.errors import BadInput

if TYPE_CHECKING:
    from sqlite_utils import Database

    from fieldcam.store.queries.blocks import BlockSummary


def stored_block(database: Database, wanted: str | None, visits: int = 0) -> BlockSummary:
    """The one of this name, or the newest that was walked so many times.

    Where none was, the newest; which one was chosen is told on standard error. Raises BadInput
    where there is none.
    """
    from fieldcam.store.queries.blocks import blocks, newest_blocks

    found = {block.id: block for block in blocks(database)}
    if wanted is None:
        newest = [found[key] for key in newest_blocks(database) if key in found]
        walked = (block for block in newest if _walked(database, block) >= visits)
        chosen = [*islice(walked, 1)] or newest
        if len(newest) > 1:
            narrate(f'Of {len(newest)} blocks this is "{chosen[0].name}"; --block names another.')
    else:
        chosen = [block for block in found.values() if block.name == wanted]
    if not chosen:
        known = ", ".join(f'"{block.name}"' for block in found.values()) or "none"
        which = "" if wanted is None else f' "{wanted}"'
        raise BadInput(f"There is no block{which} in the data folder.", f"Blocks: {known}.")
    return chosen[0]


def _walked(database: Database, block: BlockSummary) -> int:
    """How many visits have an accepted picture."""
    from fieldcam.store.queries.blocks import visits

    return sum(visit.accepted > 0 for visit in visits(database, block.id))
