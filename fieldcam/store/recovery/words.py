"""What was done to a data folder, in the operator's words."""

from __future__ import annotations

from collections.abc import Iterator

from fieldcam.store.recovery.mending import Mended, Recovered
from fieldcam.words import number_of


def recovery_lines(found: Recovered) -> Iterator[str]:
    """A sentence for each thing, what the start-up check found included."""
    if found.kept_as is not None:
        yield f"The database as it was is kept as {found.kept_as}."
    if found.mended is not None:
        yield _salvaged(found.mended)
    elif not found.pictures:
        yield "The database is whole."
    if found.pictures:
        yield (
            f"Rows made of the files beside the images: {number_of(found.pictures, 'picture')};"
            " what was decided on them is to be decided again on the Walk screen."
        )
    yield from found.report.beside_pictures
    for file in found.files:
        if file not in found.report.problems:
            yield f"{file.name} is {file.fault}: it belongs to {file.belongs_to}."


def _salvaged(mended: Mended) -> str:
    if mended.salvaged == 0:
        return (
            "Nothing could be read of the damaged database: what was decided, noted, marked and"
            " typed in is gone."
        )
    return f"Rows of the damaged database: {mended.salvaged} taken over, {mended.lost} lost."
