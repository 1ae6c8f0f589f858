"""The simulated orchard behind the camera's port.

While one capture is analysed the next one is rendered, so that the walker waits
less for it. `SimulatedCamera` takes a planned walk; `AimedCamera` takes whatever
the walker stands before, and leaves the rendering to a process of its own, since
the app's loads no rendering library.
"""

from __future__ import annotations

import ctypes
import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeout
from contextlib import suppress
from dataclasses import dataclass
from datetime import date
from multiprocessing import get_context
from multiprocessing.connection import Connection
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeVar

from fieldcam.errors import CameraUnplugged, CaptureTimeout, ExtraMissing, FieldcamError
from fieldcam.values import Calibration, RawPair

if TYPE_CHECKING:
    from fieldcam.simulator import Block, SimulatedCapture

RENDER_NICENESS = 5
"""The screen and the analysis go before pictures that are rendered ahead."""
_PR_SET_PDEATHSIG = 1
_Answer = TypeVar("_Answer")


@dataclass(frozen=True, slots=True)
class SimulatedVisit:
    """One picture to take: of which cluster, on which day, from which spot."""

    cluster_index: int
    day: int
    view: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """A picture with its ground truth."""

    visit: SimulatedVisit
    capture: SimulatedCapture


class SimulatedCamera:
    """Takes the pictures of a planned walk, in its order."""

    def __init__(self, block: Block, visits: Iterable[SimulatedVisit]) -> None:
        from fieldcam.simulator import calibration_of

        self._block = block
        self._calibration = calibration_of(block)
        self._planned = deque(visits)
        self._renderer = ThreadPoolExecutor(1, thread_name_prefix="orchard")
        self._rendering: Future[Taken] | None = None
        self._last: Taken | None = None
        self._render_ahead()

    @property
    def serials(self) -> tuple[str, str]:
        return "simulated-left", "simulated-right"

    @property
    def calibration(self) -> Calibration | None:
        return self._calibration

    @property
    def last(self) -> Taken:
        """The picture that was taken last, for those who compare with the truth."""
        if self._last is None:
            raise CameraUnplugged("The simulated camera has taken no picture yet.")
        return self._last

    def capture(self, deadline_s: float) -> RawPair:
        """The next picture of the walk."""
        if self._rendering is None:
            raise CameraUnplugged("The simulated walk has no more pictures.")
        try:
            self._last = self._rendering.result(timeout=deadline_s)
        except FutureTimeout as error:
            raise CaptureTimeout(
                f"The simulated orchard rendered no pair within {deadline_s:g} s."
            ) from error
        self._render_ahead()
        return self._last.capture.raw

    def close(self) -> None:
        self._rendering = None
        self._renderer.shutdown(wait=True, cancel_futures=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _render_ahead(self) -> None:
        self._rendering = None
        if self._planned:
            visit = self._planned.popleft()
            self._rendering = self._renderer.submit(_render, self._block, visit)


def plan_block(seed: int, clusters: int) -> Block:
    """A simulated block; says which extra is missing where the simulator cannot be loaded."""
    try:
        from fieldcam.simulator import Block
    except ModuleNotFoundError as error:
        raise ExtraMissing(
            f"The simulated orchard needs the module {error.name}.",
            "Install it with: pip install 'fieldcam[simulator]'",
        ) from error
    return Block.plan(seed=seed, clusters=clusters)


def _render(block: Block, visit: SimulatedVisit) -> Taken:
    from fieldcam.simulator import capture

    return Taken(visit, capture(block, visit.cluster_index, visit.day, view=visit.view))


@dataclass(frozen=True, slots=True)
class SimulatedRow:
    """What can be known of a simulated block without its rendering library."""

    tag_ids: tuple[int, ...]
    calibration: Calibration
    first_day: date


class OrchardProcess:
    """Plans a block and renders its pictures beside the app, one after the other."""

    def __init__(self, seed: int, clusters: int) -> None:
        context = get_context("spawn")
        self._connection, theirs = context.Pipe()
        arguments = (theirs, os.getpid(), seed, clusters)
        self._process = context.Process(target=_serve, args=arguments, daemon=True)
        self._process.start()
        theirs.close()
        self.row = self._received(SimulatedRow)

    def render(self, visit: SimulatedVisit) -> RawPair:
        """One picture; waits for it."""
        try:
            self._connection.send(visit)
        except OSError as error:
            raise CameraUnplugged("The simulated orchard has ended.") from error
        return self._received(RawPair)

    def close(self) -> None:
        """End it, in the middle of a picture too."""
        self._process.kill()
        self._process.join()

    def _received(self, kind: type[_Answer]) -> _Answer:
        """What the process is trusted to answer, or why it cannot."""
        try:
            answer: _Answer | FieldcamError = self._connection.recv()
        except (EOFError, OSError) as error:
            raise CameraUnplugged("The simulated orchard has ended.") from error
        if isinstance(answer, FieldcamError):
            raise answer
        return answer


class AimedCamera:
    """Takes the cluster that it is aimed at; that one and the next are rendered ahead."""

    def __init__(self, orchard: OrchardProcess, day: int) -> None:
        self._orchard, self._day = orchard, day
        self._renderer = ThreadPoolExecutor(1, thread_name_prefix="orchard")
        self._lock = threading.Lock()
        self._ahead: dict[SimulatedVisit, Future[RawPair]] = {}
        self._views: Counter[int] = Counter()
        self._aim = 0

    @property
    def serials(self) -> tuple[str, str]:
        return "simulated-left", "simulated-right"

    @property
    def calibration(self) -> Calibration | None:
        return self._orchard.row.calibration

    def aim(self, tag_id: int | None) -> None:
        """The walker stands before this cluster now; None: still before the last one."""
        with self._lock:
            if tag_id in self._orchard.row.tag_ids:
                self._aim = self._orchard.row.tag_ids.index(tag_id)
            self._render_ahead(self._aim, self._following)

    def capture(self, deadline_s: float) -> RawPair:
        """The next view of the cluster that it is aimed at."""
        with self._lock:
            visit = self._view(self._aim)
            self._views[self._aim] += 1
            rendering = self._ahead.pop(visit, None) or self._start(visit)
            # Most likely the walker goes on from here.
            self._render_ahead(self._following, self._aim)
        try:
            return rendering.result(timeout=deadline_s)
        except FutureTimeout as error:
            raise CaptureTimeout(
                f"The simulated orchard rendered no pair within {deadline_s:g} s."
            ) from error

    def close(self) -> None:
        """The orchard is left to its owner."""
        self._renderer.shutdown(wait=False, cancel_futures=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def _following(self) -> int:
        return (self._aim + 1) % len(self._orchard.row.tag_ids)

    def _render_ahead(self, *indices: int) -> None:
        """These clusters in this order; what nobody waits for any more is dropped."""
        wanted = [self._view(index) for index in dict.fromkeys(indices)]
        for visit in [visit for visit in self._ahead if visit not in wanted]:
            self._ahead.pop(visit).cancel()
        for visit in wanted:
            if visit not in self._ahead:
                self._ahead[visit] = self._start(visit)

    def _view(self, index: int) -> SimulatedVisit:
        return SimulatedVisit(index, self._day, self._views[index])

    def _start(self, visit: SimulatedVisit) -> Future[RawPair]:
        return self._renderer.submit(self._orchard.render, visit)


def _serve(connection: Connection, parent_pid: int, seed: int, clusters: int) -> None:
    """The orchard's process; ends with the app, however that ends."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent_pid:
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(RENDER_NICENESS)
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (1, 2):
        os.dup2(nothing, stream)  # the terminal is the app's
    try:
        block = plan_block(seed, clusters)
    except ExtraMissing as error:
        connection.send(error)
        return
    connection.send(_row(block))
    with suppress(EOFError):
        while True:
            connection.send(_render(block, connection.recv()).capture.raw)


def _row(block: Block) -> SimulatedRow:
    from fieldcam.simulator import calibration_of
    from fieldcam.simulator.capture import FIRST_DAY

    tag_ids = tuple(cluster.tag_id for cluster in block.clusters)
    return SimulatedRow(tag_ids, calibration_of(block), FIRST_DAY.date())
