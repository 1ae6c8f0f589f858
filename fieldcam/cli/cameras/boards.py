"""Takes pictures of a board with the camera, and says how to hold it next."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.cli.console import narrate
from fieldcam.errors import BadInput, CaptureTimeout

if TYPE_CHECKING:
    from fieldcam.calibration.boards import Board
    from fieldcam.calibration.calibrating import BoardPair
    from fieldcam.camera.port import FlashStereoDevice

DEADLINE_S = 5.0


def take_pairs(folder: Path, board: Board, enough: int, data: Path) -> None:
    """Fill a new or empty folder with pairs until they tell enough about the camera.

    A pair is written before the next is taken, so that whatever ends this leaves the
    pairs so far; raises DeviceError as the camera does, which the camera.toml of the data
    folder sets up.
    """
    from fieldcam.camera.finding import open_camera

    _check_empty(folder)
    with open_camera(data) as camera:
        # Only now: without a camera no empty folder is left behind.
        _make(folder)
        narrate(f"Pictures go to {folder}. Ctrl+C ends; `fieldcam calibrate {folder}` uses them.")
        _take(camera, folder, board, enough)


def _check_empty(folder: Path) -> None:
    from fieldcam.disk.durable import storage_error

    try:
        if folder.exists() and any(folder.iterdir()):
            raise BadInput(f"{folder} is not empty.", "Name a new folder for the pictures.")
    except OSError as error:
        raise storage_error(folder, error) from error


def _make(folder: Path) -> None:
    from fieldcam.disk.durable import make_folder, storage_error

    try:
        make_folder(folder)
    except OSError as error:
        raise storage_error(folder, error) from error


def _take(camera: FlashStereoDevice, folder: Path, board: Board, enough: int) -> None:
    from fieldcam.calibration.calibrating import UnseenBoard, see
    from fieldcam.calibration.guide import Guide

    guide: Guide | None = None
    while guide is None or not guide.done:
        try:
            pair = _taken(camera, f"{1 if guide is None else guide.kept + 1:03d}")
        except CaptureTimeout as error:
            narrate(error.message)
            continue
        guide = guide or Guide(pair.size_px, enough)
        found = see(board, pair)
        if isinstance(found, UnseenBoard):
            narrate(f"{found.why[:1].upper()}{found.why[1:]}. {guide.wish}")
            continue
        advice = guide.consider(found)
        if advice.keep:
            _keep(folder, pair, camera.serials)
        narrate(advice.text)


def _taken(camera: FlashStereoDevice, name: str) -> BoardPair:
    from fieldcam.calibration.calibrating import BoardPair
    from fieldcam.calibration.rectification import develop

    pair = develop(camera.capture(DEADLINE_S))
    return BoardPair(name, pair.left, pair.right)


def _keep(folder: Path, pair: BoardPair, serials: tuple[str, str]) -> None:
    from fieldcam.disk.durable import write_durably
    from fieldcam.exchange.head_file import FILE_NAME, encode_head
    from fieldcam.exchange.images import encode_png

    if not (head := folder / FILE_NAME).exists():
        write_durably(head, encode_head(serials))
    for eye, image in (("left", pair.left), ("right", pair.right)):
        write_durably(folder / f"{pair.name}_{eye}.png", encode_png(image))
