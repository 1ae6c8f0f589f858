"""`fieldcam camera grab`: pairs from the camera into a folder of captures."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcam.cli.arguments import (
    Parser,
    Subparsers,
    add_command,
    add_json,
    positive_count,
    tag_id,
)
from fieldcam.cli.cameras.chosen import CHECK_CABLE
from fieldcam.cli.console import emit, emit_json, narrate, table
from fieldcam.cli.progress import progress
from fieldcam.errors import BadInput, CameraUnplugged, DeviceError, StorageError
from fieldcam.values import ReasonCode

if TYPE_CHECKING:
    from fieldcam.camera.port import FlashStereoDevice
    from fieldcam.session.grabbing import EyeLight, Grabbed

Entry = dict[str, Any]
DOUBTS = {
    ReasonCode.SWAPPED_EYES: "What both eyes see lies further right in the right one: left and"
    " right are swapped. Name them the other way round as `left` and `right` in camera.toml"
    " (docs/camera.md).",
    ReasonCode.MISPAIRED: "Left and right show different things: check `layout` in camera.toml,"
    " and whether something is right before one eye.",
}
"""What the pictures may say against the eyes' order."""


def register(actions: Subparsers[Parser]) -> None:
    parser = add_command(actions, "grab", "take pairs into a folder of captures", _grab)
    parser.add_argument("out", type=Path, metavar="OUT_DIR", help="the folder, made if missing")
    parser.add_argument(
        "--count", type=positive_count, default=1, metavar="N", help="how many pairs (%(default)s)"
    )
    parser.add_argument(
        "--tag",
        type=tag_id,
        default=0,
        metavar="ID",
        help="the tag that the files are named by (%(default)s)",
    )
    parser.add_argument("--serial", metavar="S", help="the serial number of one of its eyes")
    add_json(parser)


def _grab(arguments: argparse.Namespace) -> None:
    """Whatever goes wrong, the pairs that were taken before it are told."""
    _check_folder(arguments.out)
    taken: list[Grabbed] = []
    trouble: DeviceError | StorageError | None = None
    try:
        for grabbed in progress(_pairs(arguments), arguments.count, "pair"):
            taken.append(grabbed)
    except (DeviceError, StorageError) as error:
        if not taken:
            raise
        trouble = error
    if arguments.json:
        emit_json(_document(taken, trouble))
    else:
        for line in _lines(taken):
            emit(line)
        narrate(f"`fieldcam import` reads {arguments.out} with a calibration.yml in it.")
    for eyes in dict.fromkeys(grabbed.eyes for grabbed in taken if grabbed.eyes is not None):
        narrate(DOUBTS[eyes])
    if trouble is not None:
        raise trouble


def _check_folder(folder: Path) -> None:
    """Found out before the flash fires, not after; it is made with the first pair."""
    try:
        there = next(each for each in (folder, *folder.absolute().parents) if each.exists())
    except OSError as error:
        raise BadInput(f"{folder} cannot be written: {error.strerror}.") from error
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        why = "it is no folder" if not there.is_dir() else "it is not yours to write into"
        raise BadInput(f"{there} cannot be written: {why}.", "Name a folder of your own.")


def _pairs(arguments: argparse.Namespace) -> Iterator[Grabbed]:
    from fieldcam.camera.finding import open_camera
    from fieldcam.session.grabbing import grab_pairs
    from fieldcam.session.set_up.today import clock_doubt, day_of
    from fieldcam.store.clock import now
    from fieldcam.store.folder import data_path_if_any

    if (doubt := clock_doubt(day_of(now()), ())) is not None:
        narrate(f"{doubt} The pairs' folder is named after it.")
    with open_camera(data_path_if_any(arguments.data)) as camera:
        _check_serial(camera, arguments.serial)
        for note in camera.notes:
            narrate(note)
        yield from grab_pairs(camera, arguments.out, arguments.tag, arguments.count)


def _check_serial(camera: FlashStereoDevice, serial: str | None) -> None:
    if serial is not None and serial not in camera.serials:
        eyes = " and ".join(camera.serials)
        raise CameraUnplugged(f"The camera here has the eyes {eyes}, not {serial}.", CHECK_CABLE)


def _document(taken: Sequence[Grabbed], trouble: DeviceError | StorageError | None) -> Entry:
    first = taken[0].raw
    height_px, width_px = first.left.shape[:2]
    return {
        "serials": {"left": first.left_serial, "right": first.right_serial},
        "pixel_format": first.pixel_format,
        "size_px": [width_px, height_px],
        "pairs": [_entry(grabbed) for grabbed in taken],
        "problem": None if trouble is None else trouble.message,
    }


def _entry(grabbed: Grabbed) -> Entry:
    raw, file = grabbed.raw, grabbed.file
    return {
        "left": str(file.left),
        "right": str(file.right),
        "taken_at": raw.taken_at.isoformat(),
        "trigger": raw.trigger_ordinal,
        "timestamps_ns": {"left": raw.left_timestamp_ns, "right": raw.right_timestamp_ns},
        "took_ms": round(grabbed.took_ms, 1),
        "saved_ms": round(grabbed.saved_ms, 1),
        "light": {"left": _light(grabbed.left), "right": _light(grabbed.right)},
        "eyes": grabbed.eyes,
    }


def _light(light: EyeLight) -> Entry:
    return {"mean": round(light.mean, 2), "clipped_fraction": round(light.clipped_fraction, 5)}


def _lines(taken: Sequence[Grabbed]) -> Iterator[str]:
    first = taken[0].raw
    height_px, width_px = first.left.shape[:2]
    eyes = f"left eye {first.left_serial}, right eye {first.right_serial}"
    yield f"{eyes}: {width_px} x {height_px} pixels each, {first.pixel_format}"
    rows = [["left file", "took ms", "saved ms", "mean left", "right", "white left", "right"]]
    rows += [_row(grabbed) for grabbed in taken]
    yield from table(rows, "<>>>>>>")


def _row(grabbed: Grabbed) -> list[str]:
    left, right = grabbed.left, grabbed.right
    return [
        f"{grabbed.file.left.parent.name}/{grabbed.file.left.name}",
        f"{grabbed.took_ms:.0f}",
        f"{grabbed.saved_ms:.0f}",
        f"{left.mean:.1f}",
        f"{right.mean:.1f}",
        f"{left.clipped_fraction:.1%}",
        f"{right.clipped_fraction:.1%}",
    ]
