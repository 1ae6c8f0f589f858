"""What test processes do with a pair, by the pair's key; a stand-in for the networks."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Event, Timer

import numpy as np
from made_readings import TAG, made_fruitlet, made_reading

from fieldcam.analysis.child import serve
from fieldcam.analysis.messages import Setup
from fieldcam.errors import ImageUnreadable, ModelMissing
from fieldcam.store.captures import SavedCapture
from fieldcam.values import ClusterReading, Expectation, TagPose

REPLIES = 4
"""The descriptor on which the process answers: after the standard ones and the requests."""


def hang() -> None:
    Event().wait()


def hang_with_interpreter() -> None:
    """As a native library that never lets go of the lock."""
    ctypes.PyDLL(None).sleep(600)


def segfault() -> None:
    ctypes.string_at(0)


def leave() -> None:
    os._exit(0)


def fall() -> None:
    os._exit(3)


def chatter() -> None:
    """On standard output and error, from Python and from below it."""
    sys.stdout.write("printed by a library\n")
    sys.stdout.flush()
    sys.stderr.write("a warning\n")
    os.write(1, b"written by native code\n")
    subprocess.run(["echo", "said by a grandchild"], check=True)


def garbage() -> None:
    os.write(REPLIES, b"this is no reply")
    hang()


def huge() -> None:
    os.write(REPLIES, b"\xff\xff\xff\xff" + bytes(1000))
    hang()


def forged() -> None:
    os.write(REPLIES, b"\x00\x00\x00\x02{}")
    hang()


def gorge() -> None:
    np.ones(1 << 34, np.uint8)


def refuse() -> None:
    raise ImageUnreadable("The left image is empty.", "Take it again.")


def stumble() -> None:
    raise ZeroDivisionError("of all things")


def nothing() -> None:
    pass


DEEDS: dict[str, Callable[[], None]] = {
    deed.__name__: deed
    for deed in (
        hang, hang_with_interpreter, segfault, leave, fall, chatter, garbage, huge, forged,
        gorge, refuse, stumble, nothing,
    )
}  # fmt: skip


class Scripted:
    """Does what the key's first word says and then finds nothing.

    Where the left file is a fifo, it first writes there which process this is.
    """

    def __init__(self, setup: Setup) -> None:
        self.setup = setup

    def warm_up(self) -> None:
        pass

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading:
        if saved.left.is_fifo():
            saved.left.write_text(str(os.getpid()))
        DEEDS[saved.key.partition(" ")[0]]()
        return made_reading([made_fruitlet(0, (100.0, 100.0))], expectation=expectation)

    def look(self, image: Path, shrunk: int, calibration: Path | None) -> tuple[TagPose, ...]:
        """Does what the file's first word says and then sees one tag, whose id is `shrunk`."""
        DEEDS[image.stem.partition(" ")[0]]()
        return (replace(TAG, id=shrunk),)


class Untouched(Scripted):
    """Has no networks."""

    def warm_up(self) -> None:
        raise ModelMissing("No stereo network is installed.", "Reinstall fieldcam.")

    def analyse(self, saved: SavedCapture, expectation: Expectation) -> ClusterReading:
        raise ModelMissing("No stereo network is installed.", "Reinstall fieldcam.")


class Falling(Scripted):
    """Cannot even warm up."""

    def warm_up(self) -> None:
        segfault()


class Leaving(Scripted):
    """Leaves of its own will while nothing is asked of it."""

    def warm_up(self) -> None:
        Timer(0.2, leave).start()


class Waiting(Scripted):
    """Warms up only once a file named by `data` is there to be read (a fifo in tests)."""

    def warm_up(self) -> None:
        assert self.setup.data is not None
        self.setup.data.read_bytes()


class Deaf(Scripted):
    """Answers the warm-up and then nothing more, not even a ping."""

    def warm_up(self) -> None:
        Timer(0.1, hang_with_interpreter).start()


WORKS = {each.__name__: each for each in (Scripted, Untouched, Falling, Leaving, Waiting, Deaf)}

if __name__ == "__main__":
    serve(WORKS[sys.argv[1]], int(sys.argv[2]))
