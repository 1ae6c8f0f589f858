"""The simulated orchard behind the camera's port.

While one capture is analysed the next one is rendered, so that the walker waits
less for it. `SimulatedCamera` takes a planned walk; `OrchardDay` has whatever the
walker stands before rendered in a process of its own, since the app's loads no
rendering library.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING, Self

from fieldcam.camera.aimed import Wanted
from fieldcam.camera.beside import PictureProcess
from fieldcam.camera.preview import Preview
from fieldcam.errors import CameraUnplugged, CaptureTimeout, ExtraMissing
from fieldcam.values import Calibration, RawPair

if TYPE_CHECKING:
    from fieldcam.simulator import BlockPlan, SimulatedCapture

SERIALS = ("simulated-left", "simulated-right")


@dataclass(frozen=True, slots=True)
class SimulatedVisit:
    """One picture to take: of which cluster, on which day, from which spot."""

    cluster_index: int
    day: int
    view: int = 0
    fault: str = "none"
    """One of the simulator's, by its value."""


@dataclass(frozen=True, slots=True, eq=False)
class TakenPicture:
    """A picture with its ground truth."""

    visit: SimulatedVisit
    capture: SimulatedCapture


class SimulatedCamera:
    """Takes the pictures of a planned walk, in its order."""

    notes: tuple[str, ...] = ()

    def __init__(self, block: BlockPlan, visits: Iterable[SimulatedVisit]) -> None:
        from fieldcam.simulator import calibration_of

        self._block = block
        self._calibration = calibration_of(block)
        self._planned = deque(visits)
        self._renderer = ThreadPoolExecutor(1, thread_name_prefix="orchard")
        self._rendering: Future[TakenPicture] | None = None
        self._last: TakenPicture | None = None
        self._render_ahead()

    @property
    def serials(self) -> tuple[str, str]:
        return SERIALS

    @property
    def calibration(self) -> Calibration | None:
        return self._calibration

    @property
    def last(self) -> TakenPicture:
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

    def preview(self, deadline_s: float) -> Preview | None:
        """Nothing: nobody aims it."""
        return None

    def attend(self) -> None:
        """Nothing can be pulled."""

    def watch_shutter(self, pressed: Callable[[], None]) -> None:
        """It has none of its own."""

    def close(self) -> None:
        self._rendering = None
        self._renderer.shutdown(wait=True, cancel_futures=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _render_ahead(self) -> None:
        self._rendering = None
        if self._planned:
            visit = self._planned.popleft()
            self._rendering = self._renderer.submit(_render, self._block, visit)


def plan_block(seed: int, clusters: int) -> BlockPlan:
    """A simulated block; says which extra is missing where the simulator cannot be loaded."""
    try:
        from fieldcam.simulator import BlockPlan
    except ModuleNotFoundError as error:
        raise ExtraMissing(
            f"The simulated orchard needs the module {error.name}.",
            "Install it with: pip install 'fieldcam[simulator]'",
        ) from error
    return BlockPlan.plan(seed=seed, clusters=clusters)


def _render(block: BlockPlan, visit: SimulatedVisit) -> TakenPicture:
    from fieldcam.simulator import Faults, Spoiling, capture

    faults = Faults(Spoiling(visit.fault))
    taken = capture(block, visit.cluster_index, visit.day, view=visit.view, faults=faults)
    return TakenPicture(visit, taken)


@dataclass(frozen=True, slots=True)
class SimulatedRow:
    """What can be known of a simulated block without its rendering library."""

    tag_ids: tuple[int, ...]
    calibration: Calibration
    first_day: date


class OrchardProcess(PictureProcess):
    """Plans a block and renders its pictures beside the app, one after the other."""

    def __init__(self, seed: int, clusters: int) -> None:
        super().__init__(_plan, seed, clusters)
        self.row = self.about(SimulatedRow)


@dataclass(frozen=True, slots=True)
class OrchardDay:
    """What an aimed camera takes on one day of a simulated block."""

    orchard: OrchardProcess
    day: int

    @property
    def serials(self) -> tuple[str, str]:
        return SERIALS

    @property
    def calibration(self) -> Calibration | None:
        return self.orchard.row.calibration

    @property
    def tag_ids(self) -> tuple[int, ...]:
        return self.orchard.row.tag_ids

    def make(self, wanted: Wanted) -> RawPair:
        index = self.tag_ids.index(wanted.tag_id)
        fault = "none" if wanted.spoiled is None else wanted.spoiled.value
        return self.orchard.picture(SimulatedVisit(index, self.day, wanted.view, fault))


def _plan(seed: int, clusters: int) -> tuple[SimulatedRow, Callable[[SimulatedVisit], RawPair]]:
    """In the orchard's process."""
    block = plan_block(seed, clusters)
    return row_of_block(block), lambda visit: _render(block, visit).capture.raw


def row_of_block(block: BlockPlan) -> SimulatedRow:
    """What of it can be known without rendering."""
    from fieldcam.simulator import calibration_of
    from fieldcam.simulator.capture import FIRST_DAY

    tag_ids = tuple(cluster.tag_id for cluster in block.clusters)
    return SimulatedRow(tag_ids, calibration_of(block), FIRST_DAY.date())
