"""How often a process may be started again before it is given up."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from time import monotonic


class RestartWindow:
    """At most `limit` restarts within any `span_s` seconds."""

    def __init__(self, limit: int, span_s: float, clock_s: Callable[[], float] = monotonic) -> None:
        self._span_s = span_s
        self._clock_s = clock_s
        self._limit = limit
        self._times_s: deque[float] = deque()

    def allow(self) -> bool:
        """Whether one more restart is allowed now; if so, it is counted."""
        now_s = self._clock_s()
        while self._times_s and now_s - self._times_s[0] >= self._span_s:
            self._times_s.popleft()
        if len(self._times_s) >= self._limit:
            return False
        self._times_s.append(now_s)
        return True
