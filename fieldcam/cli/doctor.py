"""`fieldcam doctor`: what a walk needs, checked before it."""

from __future__ import annotations

import argparse
import platform
import shutil
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING
from uuid import uuid4

from fieldcam import __version__
from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json
from fieldcam.cli.cameras.listing import SLOW, SPEEDS
from fieldcam.cli.console import emit, emit_json, printable, table
from fieldcam.disk.durable import write_durably
from fieldcam.errors import FieldcamError, UsbLibraryMissing
from fieldcam.models import Models, find_models, verify_model
from fieldcam.store.folder import data_path
from fieldcam.values import Calibration

if TYPE_CHECKING:
    from fieldcam.camera.usb3vision.devices import AttachedCamera

MIN_FREE_GB = 2.0
"""A day's walk of 70 clusters with retakes, raw, is 0.3 GB."""
SLOW_S = 1.5


class Health(StrEnum):
    """How a check ended."""

    GOOD = "good"
    WARNING = "warning"
    BAD = "bad"


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was looked at."""

    name: str
    health: Health
    text: str


def register(commands: Subparsers[Parser]) -> None:
    add_json(
        add_command(commands, "doctor", "check that this machine is ready for a walk", _doctor)
    )


def _doctor(arguments: argparse.Namespace) -> None:
    checks = list(_checks(data_path(arguments.data)))
    if arguments.json:
        healthy = all(check.health is not Health.BAD for check in checks)
        emit_json({"ok": healthy, "checks": [asdict(check) for check in checks]})
        return
    for line in table([(c.health, c.name, c.text) for c in checks], "<<<"):
        emit(line)


def _checks(data: Path) -> Iterator[Check]:
    yield _machine()
    yield _clock()
    yield _data_folder(data)
    yield _disk(data)
    models = None
    try:
        models = _intact_models(data)
    except FieldcamError as error:
        yield Check("networks", Health.BAD, str(error))
    if models is not None:
        yield Check("networks", Health.GOOD, f"intact. {models.honesty}")
        yield _self_test(models)
    yield _calibration(data)
    yield _simulator()
    yield from _cameras()


def _machine() -> Check:
    text = f"fieldcam {__version__}, Python {platform.python_version()}, {platform.platform()}"
    known = platform.machine() == "x86_64" and sys.platform == "linux"
    return Check("machine", Health.GOOD if known else Health.WARNING, text)


def _clock() -> Check:
    from fieldcam.session.set_up.today import clock_doubt, day_of
    from fieldcam.store.clock import now

    day = day_of(now())
    doubt = clock_doubt(day, ())
    return Check("clock", Health.WARNING if doubt else Health.GOOD, doubt or f"says {day}")


def _data_folder(data: Path) -> Check:
    from fieldcam.store.connection import check_disk

    probe = data / f".probe-{uuid4().hex}"
    started = perf_counter()
    try:
        write_durably(probe, b"fieldcam")
        probe.unlink()
        took_ms = (perf_counter() - started) * 1000
        check_disk(data)
    except (FieldcamError, OSError) as error:
        return Check("data folder", Health.BAD, str(error))
    return Check("data folder", Health.GOOD, f"{data} takes a durable file in {took_ms:.0f} ms")


def _disk(data: Path) -> Check:
    existing = next(folder for folder in (data, *data.parents) if folder.exists())
    free_gb = shutil.disk_usage(existing).free / 1e9
    health = Health.GOOD if free_gb >= MIN_FREE_GB else Health.WARNING
    return Check("disk", health, f"{free_gb:.1f} GB free")


def _intact_models(data: Path) -> Models:
    models = find_models(data)
    for model in models.files:
        verify_model(model)
    return models


def _self_test(models: Models) -> Check:
    """Time the second of two runs, as the networks are opened in the first."""
    from fieldcam.cli.self_test import CAMERA, TAG_ID, drawn_pair
    from fieldcam.vision.pipeline import Pipeline

    pipeline, pair = Pipeline.from_models(models), drawn_pair()
    try:
        pipeline.analyse(pair, CAMERA)
        started = perf_counter()
        reading = pipeline.analyse(pair, CAMERA)
    except FieldcamError as error:
        return Check("self-test", Health.BAD, str(error))
    took_s = perf_counter() - started
    if reading.tag is None or reading.tag.id != TAG_ID:
        return Check("self-test", Health.BAD, "the tag of the drawn pair was not read")
    health = Health.GOOD if took_s <= SLOW_S else Health.WARNING
    return Check("self-test", health, f"a drawn pair took {took_s:.2f} s")


def _calibration(data: Path) -> Check:
    from fieldcam.calibration.reading.readers import load_camera
    from fieldcam.store.calibrations import calibration_in_use

    try:
        path = calibration_in_use(data)
        if path is None:
            return Check("calibration", Health.WARNING, "none yet: run `fieldcam calibrate`")
        found = load_camera(path)
    except FieldcamError as error:
        return Check("calibration", Health.BAD, str(error))
    camera, of = (
        (found, ", for pictures that are rectified already")
        if isinstance(found, Calibration)
        else (found.rectified, "")
    )
    numbers = f"baseline {camera.baseline_mm:.2f} mm, focal length {camera.focal_px:.1f} px"
    return Check("calibration", Health.GOOD, f"{path.parent.name}: {numbers}{of}")


def _simulator() -> Check:
    from importlib.util import find_spec

    if find_spec("embreex") is None:
        return Check(
            "simulator", Health.WARNING, "not installed: pip install 'fieldcam[simulator]'"
        )
    return Check("simulator", Health.GOOD, "installed")


def _cameras() -> Iterator[Check]:
    from fieldcam.camera.usb3vision.devices import attached_cameras

    try:
        cameras = attached_cameras()
    except UsbLibraryMissing as error:
        yield Check("camera", Health.WARNING, str(error))
        return
    if not cameras:
        text = "none is attached; libusb is installed (`fieldcam camera probe` tells more)"
        yield Check("camera", Health.WARNING, text)
    yield from map(_camera, cameras)


def _camera(camera: AttachedCamera) -> Check:
    if camera.trouble is not None:
        return Check("camera", Health.BAD, str(camera.trouble))
    name = printable(f"{camera.names.model} {camera.names.serial}".strip() or camera.port)
    if not camera.speed.is_usb3:
        return Check("camera", Health.WARNING, f"{name}: {SPEEDS[camera.speed]}; {SLOW}")
    return Check("camera", Health.GOOD, f"{name}: {SPEEDS[camera.speed]}")
