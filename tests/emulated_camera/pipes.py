"""One IN endpoint: what the device has to send, and how it fits what the host asks for."""

from __future__ import annotations

import errno
from collections import deque
from dataclasses import dataclass


@dataclass(slots=True)
class Outgoing:
    """One transfer of the device's."""

    data: memoryview
    ready_ns: int
    error: int = 0
    """An errno with which it ends; 0 where it ends well."""


@dataclass(frozen=True, slots=True)
class Taken:
    """What one request of the host's got."""

    data: memoryview
    error: int = 0


_NOTHING = memoryview(b"")


class InPipe:
    """A queue of transfers; the caller holds the bus's lock."""

    def __init__(self, packet_bytes: int) -> None:
        self.packet_bytes = packet_bytes
        self.halted = False
        self._queue: deque[Outgoing] = deque()

    def __len__(self) -> int:
        return len(self._queue)

    def put(self, outgoing: Outgoing) -> None:
        self._queue.append(outgoing)

    def send(self, data: bytes, ready_ns: int) -> None:
        self.put(Outgoing(memoryview(data), ready_ns))

    def clear(self) -> None:
        self._queue.clear()

    def last_ready_ns(self) -> int:
        """When all that waits will have been sent; 0 where nothing does."""
        return self._queue[-1].ready_ns if self._queue else 0

    def waiting_bytes(self) -> int:
        return sum(len(outgoing.data) for outgoing in self._queue)

    def take(self, length: int, now_ns: int) -> Taken | None:
        """The answer to a request for `length` bytes; None where it has to wait.

        A transfer that is longer than asked for goes on in the next request, unless
        one packet of it would not fit: then the rest is lost and the host is told
        EOVERFLOW (babble), as by a real controller.
        """
        if self.halted:
            return Taken(_NOTHING, errno.EPIPE)
        if not self._queue or self._queue[0].ready_ns > now_ns:
            return None
        first = self._queue[0]
        if first.error:
            return self._failed(self._queue.popleft(), length)
        if len(first.data) <= length:
            return Taken(self._queue.popleft().data)
        if length % self.packet_bytes:
            return Taken(self._queue.popleft().data[:length], errno.EOVERFLOW)
        taken, first.data = first.data[:length], first.data[length:]
        return Taken(taken)

    def _failed(self, outgoing: Outgoing, length: int) -> Taken:
        self.halted = outgoing.error == errno.EPIPE
        return Taken(outgoing.data[:length], outgoing.error)
