"""A bus that other processes see through real libusb: umockdev's preload before them.

Linux and x86-64 only, as the preload and the layout of URBs are. The process that
serves must outlive its clients, which the preload ends when it goes.
"""

from __future__ import annotations

import os
import selectors
import shutil
import socket
import tempfile
import threading
from pathlib import Path
from typing import Self

from .bus import Plugged, UsbBus
from .claims import Claims
from .sysfs import Tree
from .uevents import Listeners
from .usbfs import WHOLE, UsbfsFile

PRELOAD = Path("/usr/lib/x86_64-linux-gnu/libumockdev-preload.so.0")
USBFS_BYTES = 16 << 20
"""What Linux grants all transfers in flight by default."""
_POLL_S = 0.005


def why_not() -> str | None:
    """Why it cannot work on this machine; None where it can."""
    if PRELOAD.is_file():
        return None
    return "umockdev's preload is not installed (apt install umockdev libumockdev0)"


class PluggedBus:
    """Serves what is on a bus to processes that run in `environment`."""

    def __init__(
        self, bus: UsbBus, capabilities: int = WHOLE, limit_bytes: int = USBFS_BYTES
    ) -> None:
        self.bus = bus
        self._capabilities = capabilities
        self._limit_bytes = limit_bytes
        # A socket's path may have 107 bytes.
        self.root = Path(tempfile.mkdtemp(prefix="usb-", dir="/tmp"))
        self._tree = Tree(self.root)
        self._doors: dict[Plugged, socket.socket] = {}
        self._claims = Claims()
        self._files: list[UsbfsFile] = []
        self._listeners = Listeners(self.root)
        self._messages = 0
        self._selector = selectors.DefaultSelector()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="usbfs door", daemon=True)
        with bus.changed:
            bus.tell(self._changed)
            for plugged in bus.plugged:
                self._changed(plugged, True)
        self._thread.start()

    @property
    def environment(self) -> dict[str, str]:
        """For the processes that shall see the bus."""
        return {**os.environ, "LD_PRELOAD": str(PRELOAD), "UMOCKDEV_DIR": str(self.root)}

    def wait_for_clients(self) -> None:
        """Until all files that clients opened are closed."""
        for file in self._files:
            file.join()

    def close(self) -> None:
        """After all clients have ended."""
        self._closing.set()
        self._thread.join()
        for file in self._files:
            file.close()
            file.join()
        for door in self._doors.values():
            door.close()
        self._selector.close()
        shutil.rmtree(self.root)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _changed(self, plugged: Plugged, came: bool) -> None:
        """Under the bus's lock."""
        if self._closing.is_set():
            return
        if came:
            self._open_door(plugged)
            self._tree.add(plugged)
        else:
            door = self._doors.pop(plugged)
            self._selector.unregister(door)
            door.close()
            self._tree.remove(plugged)
        self._messages += 1
        self._listeners.announce(plugged, came, self._messages)

    def _open_door(self, plugged: Plugged) -> None:
        door = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        door.bind(str(self._tree.socket(plugged)))
        door.listen()
        door.setblocking(False)
        self._doors[plugged] = door
        self._selector.register(door, selectors.EVENT_READ, plugged)

    def _serve(self) -> None:
        """Let clients in, and time pass for devices that nobody asks anything."""
        while not self._closing.wait(0):
            ready = self._selector.select(_POLL_S)
            with self.bus.changed:
                self.bus.poll()
                self._listeners.look()
                for key, _ in ready:
                    self._let_in(key.data)

    def _let_in(self, plugged: Plugged) -> None:
        door = self._doors.get(plugged)
        if door is None:
            return
        connection, _ = door.accept()
        connection.setblocking(True)
        file = UsbfsFile(
            connection, self.bus, plugged, self._capabilities, self._limit_bytes, self._claims
        )
        self._files = [one for one in self._files if one.is_alive()] + [file]
        file.start()
