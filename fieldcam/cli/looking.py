"""The data folder opened to look at, for commands that compute something from it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.cli.console import narrate

if TYPE_CHECKING:
    from fieldcam.store.read_only import ReadOnlyStore

READ_AGAIN = "`fieldcam recover` reads their pictures again."


@contextmanager
def looked_at(data: Path | None) -> Iterator[ReadOnlyStore]:
    """`data` is what `--data` said; damage that changes the result is told on standard error."""
    from fieldcam.store.folder import data_path
    from fieldcam.store.read_only import open_read_only
    from fieldcam.store.seals import damage_sentence

    with closing(open_read_only(data_path(data))) as store:
        if store.damaged:
            narrate(f"{damage_sentence(store.damaged)} {READ_AGAIN}")
        yield store
