"""States of a walk made up for the screens, and a walk that only notes what it is asked."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path

import numpy as np
from fieldcam.disk.raw_images import encode_raw
from fieldcam.store.queries.history import CaptureRecord, FruitletSeen, ReadingSummary
from fieldcam.store.queries.walks import ClusterState, Progress, Stop, WalkRoute
from fieldcam.store.rows.judgements import Action, Answer
from live_walks import read

from fieldcam.growth.places import Place, Word
from fieldcam.session.state import Shown, WalkState
from fieldcam.store.rows import EntryId
from fieldcam.values import ClusterReading, PixelFormat, ReasonCode, Status

STATES = {
    11: ClusterState.ACCEPTED,
    12: ClusterState.TODO,
    21: ClusterState.RETAKE,
    22: ClusterState.SKIPPED,
}
ROUTE = WalkRoute(
    "block",
    "visit",
    tuple(
        Stop(tag, f"tree {tag // 10}", f"{tag // 10}", state, ()) for tag, state in STATES.items()
    ),
)
AIM = WalkState(
    block="North",
    day=date(2026, 5, 23),
    simulated=True,
    tag_id=12,
    next_tag=21,
    progress=Progress(1, 2, 2, 2),
    before=5,
    shown=None,
    route=ROUTE,
    seconds_per_cluster=14.2,
    free_bytes=72_000_000_000,
)


def shown_with(
    folder: Path,
    reading: ClusterReading | None = None,
    failure: str = "",
    action: Action | None = None,
    struck: tuple[int, ...] = (),
) -> Shown:
    """A grey picture of tag 12 in a file of its own, with what was read in it."""
    left = folder / "left.pgm"
    left.write_bytes(encode_raw(np.full((480, 640), 90, np.uint8)))
    record = CaptureRecord(
        id="capture",
        visit="visit",
        day=AIM.day,
        taken_at=datetime(2026, 5, 23, tzinfo=UTC),
        tag_id=12,
        tag_expected=12,
        view=1,
        retake_of=None,
        action=action,
        answer=None,
        decision=None,
        left_file=left.name,
        right_file=left.name,
        reading=None if reading is None else _summary(reading, struck),
        notes=(),
    )
    return Shown(record, left, left, PixelFormat.BAYER_RG8, reading, failure, corrected=False)


def verdict(
    folder: Path, status: Status, code: ReasonCode | None = None, fruitlets: int = 5
) -> WalkState:
    """Tag 12 with this verdict; the last visit had five fruitlets."""
    return replace(AIM, shown=shown_with(folder, read(12, fruitlets, status, code)))


def _summary(reading: ClusterReading, struck: tuple[int, ...]) -> ReadingSummary:
    fruitlets = tuple(
        FruitletSeen(f.id, f.in_target, f.id not in struck, f.diameter_mm, ())
        for f in reading.fruitlets
    )
    living = sum(seen.in_target and seen.living for seen in fruitlets)
    codes = tuple(reason.code for reason in reading.verdict.reasons)
    tag = None if reading.tag is None else reading.tag.id
    return ReadingSummary("reading", reading.verdict.status, codes, tag, living, fruitlets, "0.0")


class NotedWalk:
    """Does nothing, and remembers what it was asked for."""

    def __init__(self) -> None:
        self.asked: list[tuple[object, ...]] = []
        self.previews = 0
        """How many look through the camera."""

    def start_preview(self) -> None:
        self.previews += 1

    def stop_preview(self) -> None:
        self.previews -= 1

    def shoot(self) -> None:
        self.asked.append(("shoot",))

    def second_view(self) -> None:
        self.asked.append(("second_view",))

    def accept(self) -> None:
        self.asked.append(("accept",))

    def retake(self) -> None:
        self.asked.append(("retake",))

    def fallen(self) -> None:
        self.asked.append(("fallen",))

    def hidden(self) -> None:
        self.asked.append(("hidden",))

    def accept_picture(self, capture: EntryId) -> None:
        self.asked.append(("accept_picture", capture))

    def tell_missing(self, capture: EntryId, place: Place | None, answer: Answer) -> None:
        self.asked.append(("tell_missing", capture, place, answer))

    def correct_tag(self, tag_id: int) -> None:
        self.asked.append(("correct_tag", tag_id))

    def other_target(self) -> None:
        self.asked.append(("other_target",))

    def strike(self, fruitlet: int) -> None:
        self.asked.append(("strike", fruitlet))

    def king(self, capture: EntryId, fruitlet: int) -> None:
        self.asked.append(("king", capture, fruitlet))

    def add_by_hand(self, capture: EntryId, diameter_mm: float) -> None:
        self.asked.append(("add_by_hand", capture, diameter_mm))

    def name_fruit(
        self, capture: EntryId, fruitlet: int, fruit: str, diameter_mm: float | None
    ) -> None:
        self.asked.append(("name_fruit", capture, fruitlet, fruit, diameter_mm))

    def match(self, word: Word) -> None:
        self.asked.append(("match", word))

    def note(self, text: str) -> None:
        self.asked.append(("note", text))

    def skip(self) -> None:
        self.asked.append(("skip",))

    def go_to(self, tag_id: int) -> None:
        self.asked.append(("go_to", tag_id))

    def step(self, by: int) -> None:
        self.asked.append(("step", by))

    def next_tree(self) -> None:
        self.asked.append(("next_tree",))

    def undo(self) -> None:
        self.asked.append(("undo",))

    def undo_match(self, tag_id: int) -> None:
        self.asked.append(("undo_match", tag_id))

    def undo_fruit(self, tag_id: int) -> None:
        self.asked.append(("undo_fruit", tag_id))

    def refresh(self) -> None:
        """Nothing was written."""

    def restart_analysis(self) -> None:
        self.asked.append(("restart_analysis",))

    def close(self) -> None:
        self.asked.append(("close",))
