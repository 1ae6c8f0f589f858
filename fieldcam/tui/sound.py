"""Two distinct sounds, since the eyes are on the plant."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from contextlib import suppress
from enum import StrEnum
from typing import Protocol

import numpy as np

RATE_HZ = 16_000
VARIABLE = "FIELDCAM_SOUND"


class Tune(StrEnum):
    """What is to be heard."""

    GOOD = "good"
    BAD = "bad"


_NOTES = {Tune.GOOD: (880.0, 1320.0), Tune.BAD: (330.0, 220.0)}
NOTE_S = 0.12


class Sound(Protocol):
    """Plays a tune and never waits for it."""

    def play(self, tune: Tune) -> None: ...


class Silence:
    def play(self, tune: Tune) -> None:
        """Nothing is heard."""


class Bell:
    """The terminal's bell: once for good, twice for bad."""

    def __init__(self, ring: Callable[[], None]) -> None:
        self._ring = ring

    def play(self, tune: Tune) -> None:
        for _ in range(1 if tune is Tune.GOOD else 2):
            self._ring()


class Player:
    """`aplay`, which takes samples on its standard input."""

    COMMAND = ("aplay", "-q", "-t", "raw", "-f", "S16_LE", "-c", "1", "-r", str(RATE_HZ), "-")

    def play(self, tune: Tune) -> None:
        # Without a player the screen still says it all. Two notes fit into the pipe at once.
        with suppress(OSError):
            quiet = subprocess.DEVNULL
            player = subprocess.Popen(
                self.COMMAND, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet
            )
            assert player.stdin is not None
            with player.stdin as samples:
                samples.write(waves(tune))


def waves(tune: Tune) -> bytes:
    """16-bit samples of two notes: rising for good, falling for bad."""
    seconds = np.arange(int(RATE_HZ * NOTE_S)) / RATE_HZ
    notes = [np.sin(2 * np.pi * hertz * seconds) for hertz in _NOTES[tune]]
    return (np.concatenate(notes) * 12_000).astype("<i2").tobytes()


def chosen_sound(name: str, ring: Callable[[], None]) -> Sound:
    """`player`, `bell` or `none`; else the player where there is one."""
    if name == "none":
        return Silence()
    if name == "bell" or (name != "player" and shutil.which(Player.COMMAND[0]) is None):
        return Bell(ring)
    return Player()
