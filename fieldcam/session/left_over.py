"""What a walk leaves behind where no cluster is due any more."""

from __future__ import annotations

from collections.abc import Sequence

from fieldcam.store.queries.walks import ClusterState, WalkRoute

LISTED = 6
"""So many tags are named, as more do not fit a line."""
WORDS = {
    ClusterState.SKIPPED: "Skipped",
    ClusterState.UNDECIDED: "Not decided",
    ClusterState.WAITING: "Not read",
}


def left_over(route: WalkRoute) -> str:
    """Such as "Skipped: tag 9."; empty where every cluster was accepted."""
    found = {
        word: [stop.tag_id for stop in route.stops if stop.state is state]
        for state, word in WORDS.items()
    }
    return " ".join(f"{word}: {named_tags(tags)}." for word, tags in found.items() if tags)


def named_tags(tags: Sequence[int]) -> str:
    """Such as "tags 9, 10"; the first ones of many."""
    named = ", ".join(str(tag_id) for tag_id in tags[:LISTED])
    more = f" and {len(tags) - LISTED} more" if len(tags) > LISTED else ""
    return f"{'tag' if len(tags) == 1 else 'tags'} {named}{more}"
