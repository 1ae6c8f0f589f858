"""The analysis process: `python -m fieldcam.analysis.child PARENT_PID`.

Requests come on standard input and replies leave on standard output. Both are
moved to descriptors of their own first, so that whatever a native library
prints goes to the log instead.
"""

from __future__ import annotations

import faulthandler
import os
import resource
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING

from fieldcam.parentage import die_with

if TYPE_CHECKING:
    from fieldcam.analysis.messages import Request, Setup
    from fieldcam.analysis.service import Work

NICENESS = 10
"""Both networks' threads keep two cores busy: a key's answer goes before them."""
_MEMORY_BYTES = 4 << 30
"""Four times what a whole-image run takes: only a runaway meets it."""


def serve(open_work: Callable[[Setup], Work], parent_pid: int) -> None:
    """Answer until the app closes its end, or dies."""
    die_with(parent_pid)
    _behave()
    # Only now, since they take long enough for the app to die meanwhile.
    from fieldcam.analysis.service import Service

    requests, replies = _own_pipes()
    waiting: SimpleQueue[Request] = SimpleQueue()
    threading.Thread(target=_read, args=(requests, waiting), daemon=True).start()
    service = Service(open_work)
    while True:
        _write(replies, service.answer(waiting.get()))


def _behave() -> None:
    """Leave the terminal and the memory of others alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(NICENESS)
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    limit = resource.getrlimit(resource.RLIMIT_DATA)[1]
    if limit == resource.RLIM_INFINITY or limit > _MEMORY_BYTES:
        resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY_BYTES, limit))
    with suppress(OSError):
        # Where memory runs out all the same, the kernel should take this process first.
        Path("/proc/self/oom_score_adj").write_text("800")


def _own_pipes() -> tuple[int, int]:
    """The pipes' new descriptors; standard input is empty now, output is the log."""
    requests, replies = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    os.close(nothing)
    return requests, replies


def _read(requests: int, waiting: SimpleQueue[Request]) -> None:
    """Hand on what the app asks; leave at once when it is gone, whatever is in work."""
    from fieldcam.analysis.messages import requests_in

    with os.fdopen(requests, "rb") as stream:
        for request in requests_in(stream):
            waiting.put(request)
    os._exit(0)


def _write(replies: int, data: bytes) -> None:
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(replies, rest) :]


def _vision(setup: Setup) -> Work:
    from fieldcam.analysis.work import VisionWork

    return VisionWork(setup)


if __name__ == "__main__":
    serve(_vision, int(sys.argv[1]))
