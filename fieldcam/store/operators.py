"""Who walks: those who signed in at this or another device."""

from __future__ import annotations

from sqlite_utils import Database

from fieldcam.store.connection import rows
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.walk import EventKind

_SIGNED_IN = (
    "SELECT operator.name, standing.device, standing.turn FROM event JOIN standing USING (id)"
    f" JOIN operator ON operator.id = standing.who WHERE event.event = '{EventKind.SIGNED_IN}'"
)


def operators(database: Database) -> tuple[str, ...]:
    """Their names, each once, in the order of the alphabet."""
    found = rows(database, f"SELECT DISTINCT name FROM ({_SIGNED_IN}) ORDER BY name")
    return tuple(row["name"] for row in found)


def last_operator(database: Database, device: EntryId) -> str | None:
    """Who signed in last at this device."""
    sql = f"SELECT name FROM ({_SIGNED_IN}) WHERE device = ? ORDER BY turn DESC LIMIT 1"
    found = rows(database, sql, device)
    return found[0]["name"] if found else None
