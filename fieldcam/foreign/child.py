"""Runs a reader in a process of its own, which the kernel ends where it costs too much.

For readers that can keep no bounds themselves, as libraries that unpack, or build a whole
document, before they can be asked about it: `python -m fieldcam.foreign.child MODULE
FUNCTION PATH CPU_S MEMORY_BYTES PARENT_PID`.
"""

from __future__ import annotations

import importlib
import logging
import os
import pickle
import resource
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

from fieldcam.errors import FieldcamError
from fieldcam.foreign.bounds import Bound
from fieldcam.parentage import die_with
from fieldcam.safe_path import PYTHON

Found = TypeVar("Found")

WAIT_PER_CPU_S = 6
"""A busy machine gives a process no more than a part of its time."""
_STOPPED_BY_KERNEL = (-signal.SIGXCPU, -signal.SIGKILL)
_LAST_WORDS = 2000
"""Characters of a reader that broke off, for the log."""

log = logging.getLogger(__name__)


def read_in_child(read: Callable[[Path], Found], path: Path, bound: Bound) -> Found:
    """What `read`, a function of a module, makes of the file.

    Raises what it raises of our own errors, and the bound's where it takes too long, needs
    too much memory, or breaks off.
    """
    command = [*PYTHON, "-m", __name__, read.__module__, read.__qualname__, str(path)]
    command += [str(bound.most_cpu_s), str(bound.most_memory_bytes), str(os.getpid())]
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=bound.most_cpu_s * WAIT_PER_CPU_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise _too_slow(path, bound) from error
    if done.returncode in _STOPPED_BY_KERNEL:
        raise _too_slow(path, bound)
    if done.returncode != 0:
        log.warning("%s: %s", path, done.stderr[-_LAST_WORDS:].decode(errors="replace"))
        raise bound.refuse(f"{path} is damaged: its reader broke off.")
    answer = pickle.loads(done.stdout)  # of a process of ours
    if isinstance(answer, FieldcamError):
        raise answer
    if isinstance(answer, MemoryError):
        raise bound.refuse(f"{path} unpacks to more than {bound.one} may.")
    return cast(Found, answer)


def _too_slow(path: Path, bound: Bound) -> Exception:
    return bound.refuse(f"{path} takes longer to read than {bound.one} may.")


def _main(module: str, function: str, path: str, *numbers: str) -> None:
    cpu_s, memory_bytes, parent_pid = map(int, numbers)
    die_with(parent_pid)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
    resource.setrlimit(resource.RLIMIT_DATA, (memory_bytes, memory_bytes))
    answers = os.dup(1)
    os.dup2(2, 1)  # what a library prints is no answer
    answer: object
    try:
        answer = getattr(importlib.import_module(module), function)(Path(path))
        content = pickle.dumps(answer)
    except FieldcamError as error:
        content = pickle.dumps(error)
    except MemoryError:
        content = pickle.dumps(MemoryError())
    with os.fdopen(answers, "wb") as stream:
        stream.write(content)


if __name__ == "__main__":
    _main(*sys.argv[1:])
