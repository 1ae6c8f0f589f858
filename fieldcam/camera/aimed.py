"""A camera without hardware that takes whatever the walker stands before.

It misbehaves on command, as a real one does unasked. Pictures are made ahead, so
that the walker waits less for them.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from enum import StrEnum
from time import monotonic
from typing import Protocol, Self

import numpy as np

from fieldcam.camera.preview import Preview
from fieldcam.errors import CameraUnplugged, CaptureTimeout
from fieldcam.values import Calibration, ImageU8, RawPair

SLOW_S = 5.0
"""A slow camera is given up after this time, whatever the deadline."""
FLASH_S = 0.8
"""Until the flash is charged again."""
WALK_UP_S, FARTHEST = 3.0, 1.7
"""How long the walker comes closer before a cluster, and from how many times its range."""
SHRUNK = 3
"""A tag at 60 cm still has 26 px to a side then, three for each of its cells."""


class Mishap(StrEnum):
    """What the camera can be told to do wrong; it lasts for one picture."""

    UNPLUGGED = "unplugged"
    """Lasts until it is plugged in again."""
    SLOW = "slow"
    """Gives no pair before the deadline."""
    DARK = "dark"
    BLURRED = "blurred"
    MISPAIRED = "mispaired"
    SWAPPED_EYES = "swapped_eyes"


OF_THE_CABLE = (Mishap.UNPLUGGED, Mishap.SLOW)
"""Here there is no picture; the others spoil it, and are faults of the simulator by name."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """A picture to make."""

    tag_id: int
    view: int
    """Counts the pictures of this cluster from 0."""
    spoiled: Mishap | None = None


class PictureSource(Protocol):
    """Where the pictures come from."""

    @property
    def serials(self) -> tuple[str, str]: ...

    @property
    def calibration(self) -> Calibration | None: ...

    @property
    def tag_ids(self) -> tuple[int, ...]:
        """Of all clusters, in walking order."""
        ...

    def make(self, wanted: Wanted) -> RawPair:
        """One picture; waits for it."""
        ...


class AimedCamera:
    """Takes the cluster that it is aimed at; that one and the next are made ahead.

    It can be opened again after it was closed.
    """

    def __init__(self, pictures: PictureSource, taken: Mapping[int, int] | None = None) -> None:
        """`taken` says how many pictures of each tag there were before; their clock goes on."""
        self._pictures = pictures
        self._lock = threading.Lock()
        self._maker: ThreadPoolExecutor | None = None
        self._ahead: dict[Wanted, Future[RawPair]] = {}
        self._views: Counter[int] = Counter(taken)
        self._aim = pictures.tag_ids[0]
        self._mishap: Mishap | None = None
        self._pulled: Future[RawPair] = Future()
        self._pressed: Callable[[], None] | None = None
        self._approached, self._approached_s = Wanted(-1, 0), 0.0
        self._flashed_s = float("-inf")

    notes: tuple[str, ...] = ()

    @property
    def serials(self) -> tuple[str, str]:
        return self._pictures.serials

    @property
    def calibration(self) -> Calibration | None:
        return self._pictures.calibration

    def open(self) -> Self:
        """Raises CameraUnplugged while it is told to be."""
        with self._lock:
            self._check_cable()
            self._maker = self._maker or ThreadPoolExecutor(1, thread_name_prefix="pictures")
            self._make_ahead(self._aim, self._following)
        return self

    def aim(self, tag_id: int | None) -> None:
        """The walker stands before this cluster now; None: still before the last one."""
        with self._lock:
            if tag_id in self._pictures.tag_ids:
                self._aim = tag_id
            self._make_ahead(self._aim, self._following)

    def make_first(self, tag_id: int, deadline_s: float) -> None:
        """Wait until the picture that is due first is made, so that its shutter need not."""
        self.aim(tag_id)
        with self.open()._lock:
            making = self._ahead[self._wanted(self._aim)]
        wait((making,), deadline_s)

    def misbehave(self, mishap: Mishap | None) -> None:
        """Do this wrong from now on; None: behave again."""
        with self._lock:
            self._mishap = mishap
            if mishap is Mishap.UNPLUGGED and not self._pulled.done():
                self._pulled.set_exception(_unplugged())
            elif mishap is not Mishap.UNPLUGGED:
                self._pulled = Future()
            self._make_ahead(self._aim, self._following)

    def press(self) -> None:
        """As if its own shutter was pressed."""
        if self._pressed is not None:
            self._pressed()

    def attend(self) -> None:
        """Raises CameraUnplugged while it is told to be."""
        with self._lock:
            self._check_cable()

    def watch_shutter(self, pressed: Callable[[], None]) -> None:
        self._pressed = pressed

    def preview(self, deadline_s: float) -> Preview | None:
        """The picture that comes next, as one sees it who walks up to it; None while it is made."""
        with self._lock:
            self._check_cable()
            wanted = self._wanted(self._aim)
            making = self._ahead.get(wanted)
        if making is None or not making.done():
            return None
        if wanted != self._approached:
            self._approached, self._approached_s = wanted, monotonic()
        left = walked_up(making.result().left, monotonic() - self._approached_s)
        return Preview(left, SHRUNK, monotonic() - self._flashed_s > FLASH_S)

    def capture(self, deadline_s: float) -> RawPair:
        """The next view of the cluster that it is aimed at."""
        with self._lock:
            self._check_cable()
            deadline_s = min(deadline_s, SLOW_S) if self._mishap is Mishap.SLOW else deadline_s
            pulled, making = self._pulled, self._fire()
        done, _ = wait((pulled, making), deadline_s, FIRST_COMPLETED)
        if not done:
            sentence = f"The camera gave no pair within {deadline_s:g} s."
            raise CaptureTimeout(sentence, "Take the picture again.")
        self._flashed_s = monotonic()
        return (pulled if pulled in done else making).result()

    def close(self) -> None:
        """What makes the pictures is left to its owner."""
        with self._lock:
            if self._maker is not None:
                self._maker.shutdown(wait=False, cancel_futures=True)
            self._maker = None
            self._ahead.clear()

    def __enter__(self) -> Self:
        return self.open()

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def _following(self) -> int:
        tags = self._pictures.tag_ids
        return tags[(tags.index(self._aim) + 1) % len(tags)]

    def _check_cable(self) -> None:
        if self._mishap is Mishap.UNPLUGGED:
            raise _unplugged()

    def _fire(self) -> Future[RawPair]:
        """The promise of the picture; never kept where the camera is slow."""
        wanted, mishap = self._wanted(self._aim), self._mishap
        self._mishap = None
        if mishap is Mishap.SLOW:
            return Future()
        making = self._ahead.pop(wanted, None) or self._make(wanted)
        self._views[self._aim] += 1
        # Most likely the walker goes on from here.
        self._make_ahead(self._following, self._aim)
        return making

    def _make(self, wanted: Wanted) -> Future[RawPair]:
        if self._maker is None:
            raise CameraUnplugged("The camera was closed.")
        return self._maker.submit(self._pictures.make, wanted)

    def _make_ahead(self, *tag_ids: int) -> None:
        """These clusters in this order; what nobody waits for any more is dropped."""
        if self._maker is None:
            return
        wanted = [self._wanted(tag_id) for tag_id in dict.fromkeys(tag_ids)]
        for unwanted in [each for each in self._ahead if each not in wanted]:
            self._ahead.pop(unwanted).cancel()
        for each in wanted:
            if each not in self._ahead:
                self._ahead[each] = self._make(each)

    def _wanted(self, tag_id: int) -> Wanted:
        """A mishap spoils the next picture, which is most likely one of where it is aimed."""
        spoils = tag_id == self._aim and self._mishap not in (None, *OF_THE_CABLE)
        return Wanted(tag_id, self._views[tag_id], self._mishap if spoils else None)


def walked_up(picture: ImageU8, seconds: float) -> ImageU8:
    """A picture (H, W, …) shrunk, and smaller still for who is on the way to it."""
    away = 1 + (FARTHEST - 1) * max(0.0, 1 - seconds / WALK_UP_S)
    height, width = picture.shape[:2]
    rows, columns = (_sampled(length, away) for length in (height, width))
    return np.ascontiguousarray(picture[rows[:, None], columns])


def _sampled(length: int, away: float) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Which of so many rows or columns are seen; the outermost stand for what lies beyond."""
    places = np.arange(length // SHRUNK) * SHRUNK
    middle = (length - 1) / 2
    seen = np.clip(np.round(middle + (places - middle) * away), 0, length - 1)
    return np.asarray(seen, np.intp)


def _unplugged() -> CameraUnplugged:
    return CameraUnplugged("The camera is unplugged.", "Check its cable; it is found by itself.")
