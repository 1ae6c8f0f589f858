"""Orders for a running emulated head, one a line, through a named pipe.

`unplug`, `plug`, `plug usb2`, `press` (the head's own shutter), `next` (the next
cluster), and every fault by its name, with how often it shall strike: `dark 2`.
"""

from __future__ import annotations

import os
import select
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from .descriptors import Speed
from .faults import Fault
from .shapes import StereoHead

_LOOK_S = 0.1


class Orders:
    """Carries out what is written to a pipe, in a thread of its own."""

    def __init__(self, path: Path, head: StereoHead, go_on: Callable[[], object]) -> None:
        self.path = path
        self._head = head
        self._go_on = go_on
        self._closing = threading.Event()
        os.mkfifo(path)
        # Opened for both, so that it does not end with the first writer.
        self._pipe = os.open(path, os.O_RDWR)
        self._thread = threading.Thread(target=self._read, name="orders", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        self._thread.join()
        os.close(self._pipe)

    def carry_out(self, line: str) -> None:
        """One order; raises ValueError where it is none."""
        match line.split():
            case ["unplug"]:
                self._head.unplug()
            case ["plug"]:
                self._head.plug()
            case ["plug", "usb2"]:
                self._head.plug(Speed.HIGH)
            case ["press"]:
                self._head.cameras[0].press_shutter()
            case ["next"]:
                self._go_on()
            case [name]:
                self._arm(Fault(name), 1)
            case [name, times]:
                self._arm(Fault(name), int(times))

    def _arm(self, fault: Fault, times: int) -> None:
        for camera in self._head.cameras:
            camera.faults.arm(fault, times)

    def _read(self) -> None:
        rest = ""
        while not self._closing.is_set():
            if not select.select([self._pipe], [], [], _LOOK_S)[0]:
                continue
            *lines, rest = (rest + os.read(self._pipe, 4096).decode()).split("\n")
            for line in lines:
                try:
                    self.carry_out(line)
                except ValueError as error:
                    sys.stderr.write(f"emulated camera: {error}\n")
