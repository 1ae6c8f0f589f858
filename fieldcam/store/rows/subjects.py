"""What the rows of a kind are about, as SQL of one of them, called `word`."""

from __future__ import annotations

from dataclasses import dataclass

_PICTURES = "(SELECT value FROM json_each(here.captures))"
_READINGS = f"(SELECT id FROM reading WHERE capture IN {_PICTURES})"


@dataclass(frozen=True, slots=True)
class OfCluster:
    """A word on a cluster: U on Walk takes it back, and the Cluster screen lists it."""

    tag: str
    """The number of the cluster's tag; NULL where it is not known any more."""
    here: str
    """Whether it is about the cluster `here`, of which captures, block and tag_id are given."""
    picture: str = "NULL"
    """The capture; NULL: the cluster on that visit."""

    def __or__(self, other: OfCluster) -> OfCluster:
        """About the one or the other, whichever a row names; the picture is that of the first."""
        return OfCluster(
            f"coalesce({other.tag}, {self.tag})", f"{self.here} OR {other.here}", self.picture
        )


@dataclass(frozen=True, slots=True)
class OfBlock:
    """A change of how a block is set up, which U on Set-up takes back."""

    block: str = "word.block"


def of_capture(column: str = "capture") -> OfCluster:
    """`column` names the picture."""
    return OfCluster(
        f"(SELECT tag_id FROM capture_now WHERE id = word.{column})",
        f"word.{column} IN {_PICTURES}",
        f"word.{column}",
    )


def of_reading(column: str = "reading") -> OfCluster:
    """`column` names a reading of the picture."""
    return OfCluster(
        f"(SELECT tag_id FROM capture_now WHERE reading = word.{column})",
        f"word.{column} IN {_READINGS}",
        f"(SELECT capture FROM reading WHERE reading.id = word.{column})",
    )


ON_A_VISIT = OfCluster(
    "word.tag_id",
    "(word.tag_id = here.tag_id"
    " AND word.visit IN (SELECT id FROM visit WHERE visit.block = here.block))",
)
IN_A_BLOCK = OfCluster("word.tag_id", "(word.block = here.block AND word.tag_id = here.tag_id)")
