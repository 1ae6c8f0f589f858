"""When something happened, in a form that survives a clock that was set wrongly."""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from pathlib import Path
from socket import gethostname

_BOOT_ID = Path("/proc/sys/kernel/random/boot_id")
_MACHINE_IDS = (Path("/etc/machine-id"), Path("/var/lib/dbus/machine-id"))


@dataclass(frozen=True, slots=True)
class Moment:
    """A point in time."""

    utc: datetime
    """Timezone-aware, UTC; what the wall clock said."""
    utc_offset_min: int
    """Local time minus UTC where it was taken."""
    boot: str
    """Changes with every start of the machine."""
    boot_ns: int
    """Since that start, time asleep included; no one can set it."""


def now() -> Moment:
    """This moment."""
    local = datetime.now().astimezone()
    offset = local.utcoffset()
    minutes = 0 if offset is None else round(offset.total_seconds() / 60)
    boot_ns = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    return Moment(local.astimezone(UTC), minutes, _boot_id(), boot_ns)


def seconds_between(earlier: Moment, later: Moment) -> float | None:
    """Elapsed time; None where only wall clocks could tell and they contradict the order."""
    if earlier.boot == later.boot:
        return (later.boot_ns - earlier.boot_ns) / 1e9
    seconds = (later.utc - earlier.utc).total_seconds()
    return seconds if seconds >= 0 else None


def utc_text(when: datetime) -> str:
    """UTC in a form of constant width, which sorts as text."""
    return when.astimezone(UTC).isoformat(timespec="microseconds")


@cache
def machine_id() -> str:
    """A hash of what identifies this machine; the id itself is not to be passed on."""
    for path in _MACHINE_IDS:
        try:
            own = path.read_text(encoding="ascii").strip()
        except (OSError, UnicodeDecodeError):
            continue
        if own:
            return sha256(f"fieldcam {own}".encode()).hexdigest()
    return sha256(f"fieldcam {gethostname()}".encode()).hexdigest()


@cache
def _boot_id() -> str:
    try:
        return _BOOT_ID.read_text(encoding="ascii").strip()
    except OSError:
        return ""
