"""The real app in a terminal, with rendered pictures, telling what happens and when."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import monotonic

from live_walks import ToldCamera
from terminals import ESCAPE, Terminal
from torture.rowed_walk import open_row

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.supervisor import CHILD, Supervisor
from fieldcam.app.running import run
from fieldcam.camera.simulated import SimulatedCamera, SimulatedVisit, plan_block
from fieldcam.images.pixels import mosaic
from fieldcam.session.events import (
    AnalysisTrouble,
    Changed,
    Listener,
    LiveEvent,
    Saved,
    VerdictReady,
)
from fieldcam.session.live import LiveWalk
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store
from fieldcam.values import Calibration, PixelFormat, RawPair

RENDER_S = 300.0
PATIENCE_S = 120.0


@dataclass(frozen=True, slots=True)
class Scenery:
    """Rendered pairs and the camera that took them."""

    calibration: Calibration
    pairs: Sequence[RawPair]


def render(pictures: int) -> Scenery:
    """So many clusters of one simulated block; takes seconds for each."""
    block = plan_block(1, pictures)
    with SimulatedCamera(block, [SimulatedVisit(index, 0) for index in range(pictures)]) as camera:
        assert camera.calibration is not None
        pairs = [_as_a_camera_gives(camera.capture(RENDER_S)) for _ in range(pictures)]
        return Scenery(camera.calibration, pairs)


def _as_a_camera_gives(rendered: RawPair) -> RawPair:
    """Behind a colour filter; not marked, since its folder is thrown away."""
    bayer = PixelFormat.BAYER_RG8
    left, right = mosaic(rendered.left, bayer), mosaic(rendered.right, bayer)
    return replace(rendered, left=left, right=right, pixel_format=bayer, simulated=False)


class SceneryCamera(ToldCamera):
    """Gives the pairs in turn, each time with another first row, so that no two are alike."""

    def __init__(self, pairs: Sequence[RawPair]) -> None:
        super().__init__()
        self._pairs = pairs

    def capture(self, deadline_s: float) -> RawPair:
        raw = self._pairs[self.taken % len(self._pairs)]
        self.taken += 1
        left, right = raw.left.copy(), raw.right.copy()
        for image in (left, right):
            image[0].flat[:4] = list(self.taken.to_bytes(4, "little"))
        return replace(raw, left=left, right=right)


class Telling:
    """The app, and what it has told so far."""

    def __init__(self, terminal: Terminal, told: int) -> None:
        self.terminal = terminal
        self._told, self._rest = told, b""
        self.app = 0
        self.pending = 0
        self.saved_ms: list[float] = []
        self.verdict_ms: list[float] = []
        self.unread = 0
        """Pictures that got no verdict, as on a machine too busy for the deadline."""
        self.keys: list[str] = []
        os.set_blocking(told, False)

    def look_on(self, seconds: float) -> None:
        until_s = monotonic() + seconds
        while True:
            left_s = until_s - monotonic()
            self.terminal.look(max(0.0, min(left_s, 0.02)))
            self._listen()
            if left_s <= 0:
                return

    def wait_for(self, saved: int = 0, read: int = 0) -> None:
        """Until so many pictures are saved, and read or given up."""
        until_s = monotonic() + PATIENCE_S
        while len(self.saved_ms) < saved or len(self.verdict_ms) + self.unread < read:
            assert monotonic() < until_s, ESCAPE.sub("", self.terminal.seen[-2000:])
            self.look_on(0.01)

    def _listen(self) -> None:
        try:
            piece = os.read(self._told, 1 << 16)
        except BlockingIOError:
            return
        *lines, self._rest = (self._rest + piece).split(b"\n")
        for line in lines:
            what, _, value = line.decode().partition(" ")
            match what:
                case "saved":
                    milliseconds, _, key = value.partition(" ")
                    self.saved_ms.append(float(milliseconds))
                    self.keys.append(key)
                case "read":
                    self.verdict_ms.append(float(value))
                case "unread":
                    self.unread += 1
                case "pending":
                    self.pending = int(value)
                case "app":
                    self.app = int(value)


@contextmanager
def telling_app(folder: Path, scenery: Scenery, child: Sequence[str] = CHILD) -> Iterator[Telling]:
    """The app, walked until this ends."""
    reader, writer = os.pipe()
    with Terminal(partial(_screens, folder, scenery, child, writer), (120, 40)) as terminal:
        os.close(writer)
        told = Telling(terminal, reader)
        terminal.wait_for("North")
        told.look_on(0.5)
        yield told
    os.close(reader)


def _screens(folder: Path, scenery: Scenery, child: Sequence[str], tell: int) -> None:
    store, visit = open_row(folder)
    os.write(tell, f"app {os.getpid()}\n".encode())
    with store:
        run(partial(_start, store, visit, scenery, child, tell), ())


def _start(
    store: Store,
    visit: EntryId,
    scenery: Scenery,
    child: Sequence[str],
    tell: int,
    listener: Listener,
) -> LiveWalk:
    def hear(event: LiveEvent) -> None:
        listener(event)
        if isinstance(event, Saved):
            os.write(tell, f"saved {event.duration_ms} {event.capture.key}\n".encode())
        elif isinstance(event, VerdictReady):
            os.write(tell, f"read {event.duration_ms}\n".encode())
        elif isinstance(event, AnalysisTrouble):
            os.write(tell, b"unread\n")
        elif isinstance(event, Changed):
            os.write(tell, f"pending {event.state.analysis.pending}\n".encode())

    setup = Setup(scenery.calibration)
    return LiveWalk(
        store,
        visit,
        SceneryCamera(scenery.pairs).open,
        lambda changed: Supervisor(setup, None, changed, child=child),
        hear,
    )
