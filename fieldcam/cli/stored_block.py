"""The block that a command names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fieldcam.errors import BadInput

if TYPE_CHECKING:
    from sqlite_utils import Database

    from fieldcam.store.blocks import BlockSummary


def stored_block(database: Database, wanted: str | None) -> BlockSummary:
    """The one of this name, or the newest; raises BadInput where there is none."""
    from fieldcam.store.blocks import blocks, newest_block

    found = blocks(database)
    if wanted is None:
        newest = newest_block(database)
        chosen = [block for block in found if block.id == newest]
    else:
        chosen = [block for block in found if block.name == wanted]
    if not chosen:
        known = ", ".join(block.name for block in found) or "none"
        which = "" if wanted is None else f" {wanted}"
        raise BadInput(f"There is no block{which} in the data folder.", f"Blocks: {known}.")
    return chosen[0]
