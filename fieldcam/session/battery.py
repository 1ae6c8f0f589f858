"""The machine's batteries, as the kernel describes them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

SUPPLIES = Path("/sys/class/power_supply")


@dataclass(frozen=True, slots=True)
class Battery:
    """One battery of the machine itself."""

    percent: int
    status: str
    """The kernel's word in lower case, such as `discharging`."""


def batteries(folder: Path = SUPPLIES) -> tuple[Battery, ...]:
    """Those of mice and the like apart; none where the machine has none."""
    found = (_battery(supply) for supply in sorted(folder.glob("*")))
    return tuple(battery for battery in found if battery is not None)


def _battery(supply: Path) -> Battery | None:
    if _word(supply / "type") != "battery" or _word(supply / "scope") == "device":
        return None
    percent = _word(supply / "capacity")
    return Battery(int(percent), _word(supply / "status")) if percent.isdigit() else None


def _word(path: Path) -> str:
    """What a file says; nothing where it is missing or gone in the meantime."""
    try:
        return path.read_text(encoding="ascii").strip().lower()
    except (OSError, UnicodeDecodeError):
        return ""
