"""Batteries, as a folder like the kernel's describes them."""

from __future__ import annotations

from pathlib import Path

from fieldcam.session.battery import Battery, batteries


def supply(folder: Path, name: str, **files: str) -> None:
    (folder / name).mkdir()
    for file, text in files.items():
        (folder / name / file).write_text(f"{text}\n")


def test_only_the_machines_own_batteries_count(tmp_path: Path) -> None:
    supply(tmp_path, "AC", type="Mains", online="1")
    supply(tmp_path, "BAT0", type="Battery", capacity="87", status="Discharging")
    supply(tmp_path, "BAT1", type="Battery", capacity="4", status="Charging", scope="System")
    supply(tmp_path, "mouse", type="Battery", capacity="50", status="Unknown", scope="Device")
    supply(tmp_path, "odd", type="Battery")
    assert batteries(tmp_path) == (Battery(87, "discharging"), Battery(4, "charging"))


def test_a_machine_without_a_battery_has_none(tmp_path: Path) -> None:
    assert batteries(tmp_path) == batteries(tmp_path / "absent") == ()
