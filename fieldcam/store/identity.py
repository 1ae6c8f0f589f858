"""Which device writes: a random id, kept together with the machine it was made on."""

from __future__ import annotations

from dataclasses import dataclass
from socket import gethostname

from sqlite_utils import Database

from fieldcam.store.clock import machine_id, now
from fieldcam.store.connection import rows, writing
from fieldcam.store.journal import Clock, append
from fieldcam.store.rows import Draft, EntryId, new_id
from fieldcam.store.rows.orchard import Device


@dataclass(frozen=True, slots=True)
class Identity:
    """The device that this file belongs to on this machine."""

    device: EntryId
    copied: bool
    """The file was brought from another machine, or its disk was cloned."""


def identify(database: Database, machine: str | None = None, clock: Clock = now) -> Identity:
    """This machine's device; made when the file has none for it.

    Two machines that went on from copies of one file would otherwise give the
    same numbers to different rows.
    """
    machine = machine or machine_id()
    with writing(database):
        known = rows(
            database,
            "SELECT device.id, device.machine FROM here JOIN device ON device.id = here.device"
            " ORDER BY here.rowid DESC",
        )
        for row in known:
            if row["machine"] == machine:
                return Identity(row["id"], copied=known[-1]["id"] != row["id"])
        device = new_id()
        append(database, device, Draft(Device(machine, gethostname()), device), clock=clock)
        database.execute("INSERT INTO here (device) VALUES (?)", [device])
    return Identity(device, copied=bool(known))
