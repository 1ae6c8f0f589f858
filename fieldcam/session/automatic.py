"""Fires by itself once all cues are right for a moment; never twice at one cluster."""

from __future__ import annotations

from dataclasses import dataclass, field

from fieldcam.session.aim.cue import Cue
from fieldcam.session.state import CameraState, WalkState
from fieldcam.store.queries.walks import ClusterState

LOOKS = 2
"""How many looks in a row must be right: about a second."""


@dataclass(slots=True)
class Automatic:
    """Off until it is switched on; lives as long as the walk."""

    on: bool = False
    _fired: set[int] = field(default_factory=set)
    _at: int | None = None
    _right: int = 0
    """Looks in a row that were right there."""

    def switch(self) -> None:
        self.on, self._right = not self.on, 0

    def may(self, state: WalkState) -> bool:
        """Whether the cluster can still be taken by itself.

        One with a picture cannot, nor can a new one: its tag stays in view.
        """
        new = state.tag_id is None
        return not new and state.tag_id not in self._fired and state.shown is None

    def pull(self, cue: Cue, state: WalkState) -> bool:
        """Whether to fire on this look."""
        if state.tag_id != self._at:
            self._at, self._right = state.tag_id, 0
        right = cue.ready and cue.due == state.tag_id and state.camera is CameraState.READY
        self._right = self._right + 1 if right else 0
        if not self.on or self._right < LOOKS or not self.may(state):
            return False
        if state.tag_id is not None:
            self._fired.add(state.tag_id)
        self._right = 0
        return True


def accepted_since(before: WalkState, state: WalkState) -> bool:
    """Whether the cluster of `before` was accepted and the next one waits for its picture."""
    if before.tag_id is None or state.tag_id in (None, before.tag_id) or state.shown is not None:
        return False
    stops = (walk.route.stop(before.tag_id) for walk in (before, state))
    then, now = (stop is not None and stop.state is ClusterState.ACCEPTED for stop in stops)
    return now and not then
