"""What the Cluster screen and Two days share: both show one cluster, and step to any other."""

from __future__ import annotations

from sqlite_utils import Database
from textual.binding import Binding

from fieldcam.session.commands import Walk
from fieldcam.session.state import WalkState
from fieldcam.store.queries.history import photographed_tags
from fieldcam.tui.screens.page import Page
from fieldcam.tui.text.news import News

NO_CLUSTERS = "This block has no clusters yet."

ONWARD = (
    Binding("n", "other_tag(1)", "Tag", key_display="n/p", tooltip="The next tag, the one before"),
    Binding("p", "other_tag(-1)", "Tag before", show=False),
    Binding("g", "app.growth", "Growth", show=False, tooltip="Growth: how many will stay"),
)
"""To stand among the keys of each screen."""


class ClusterPage(Page):
    """Of the cluster that was asked for, else of the one where the operator stands."""

    def __init__(self, walk: Walk, state: WalkState | None = None) -> None:
        super().__init__(walk, state)
        self.tag_id: int | None = None
        """What is shown."""
        self.tags: tuple[int, ...] = ()
        """All that could be."""

    def action_other_tag(self, by: int) -> None:
        if self.state is None or not self.tags:
            return
        here = self.tags.index(self.tag_id) if self.tag_id in self.tags else -by
        self.looks_at = self.tags[(here + by) % len(self.tags)]
        # What was said of the cluster before is not said of this one.
        self.hear(News(""))
        self.show(self.state)


def block_tags(database: Database, state: WalkState) -> tuple[int, ...]:
    """Those of the route in its order, then others of which there are pictures."""
    route = [stop.tag_id for stop in state.route.stops]
    return tuple(dict.fromkeys([*route, *photographed_tags(database, state.route.block)]))


def tag_to_show(asked: int | None, state: WalkState, tags: tuple[int, ...]) -> int | None:
    """Without one that is asked for, where the operator stands, else the route's last one."""
    stops = state.route.stops
    if asked is not None or state.tag_id is not None:
        return state.tag_id if asked is None else asked
    return stops[-1].tag_id if stops else next(iter(tags), None)
