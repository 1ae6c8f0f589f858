"""`fieldcam calibrate`: pictures of a board in, the camera's calibration out."""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from fieldcam.cli.arguments import (
    Parser,
    Subparsers,
    add_command,
    add_json,
    positive_count,
    positive_number,
)
from fieldcam.cli.cameras.boards import take_pairs
from fieldcam.cli.console import emit, emit_json, narrate, table
from fieldcam.cli.progress import progress
from fieldcam.errors import BadInput

if TYPE_CHECKING:
    from fieldcam.calibration.boards import Board
    from fieldcam.calibration.calibrating import BoardPair, Calibrated
    from fieldcam.exchange.board_pairs import PairFolder

BOARDS = ("checkerboard", "charuco")
PAPERS = ("a4", "letter")
SQUARES = re.compile(r"(\d{1,3})x(\d{1,3})", re.ASCII | re.IGNORECASE)
PICTURE_NAME, REPORT_NAME = "coverage.png", "report.json"


def register(commands: Subparsers[Parser]) -> None:
    parser = add_command(
        commands, "calibrate", "calibrate the camera by pictures of a board", _calibrate
    )
    parser.add_argument(
        "folder",
        type=Path,
        nargs="?",
        metavar="DIR",
        help="pairs <n>_left.png and <n>_right.png, or folders left and right",
    )
    parser.add_argument(
        "--board", choices=BOARDS, default=BOARDS[0], help="what is printed on it (%(default)s)"
    )
    parser.add_argument(
        "--squares",
        type=squares,
        default=(9, 6),
        metavar="CxR",
        help="columns and rows of squares, not of corners (9x6)",
    )
    parser.add_argument(
        "--square-mm",
        type=positive_number,
        default=20.0,
        metavar="MM",
        help="side of a square as measured on the print (%(default)s)",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="a new folder for the result (else the data folder, and the app uses it)",
    )
    parser.add_argument(
        "--camera", action="store_true", help="first take the pairs into DIR with the camera"
    )
    parser.add_argument(
        "--views", type=positive_count, default=20, metavar="N", help="how many (%(default)s)"
    )
    parser.add_argument(
        "--print-board", type=Path, metavar="OUT.pdf", help="only write the board for a printer"
    )
    parser.add_argument("--paper", choices=PAPERS, default="a4", help="its format (%(default)s)")
    add_json(parser)


def squares(text: str) -> tuple[int, int]:
    """An argparse type for columns and rows."""
    match = SQUARES.fullmatch(text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of squares, such as 9x6")
    return int(match[1]), int(match[2])


def _calibrate(arguments: argparse.Namespace) -> None:
    from fieldcam.calibration.boards import Board, Kind

    columns, rows = arguments.squares
    board = Board(Kind(arguments.board), columns, rows, arguments.square_mm)
    if arguments.print_board is not None:
        _print_board(arguments, board)
    elif arguments.folder is None:
        raise BadInput("Which folder holds the pairs?", "See `fieldcam calibrate --help`.")
    else:
        _calibrate_folder(arguments, board)


def _print_board(arguments: argparse.Namespace, board: Board) -> None:
    from fieldcam.disk.targets import check_new_target, write_target
    from fieldcam.exchange.calibration_report import board_report
    from fieldcam.report.board_sheets import board_sheet
    from fieldcam.report.pdf import pdf_document
    from fieldcam.report.tag_sheets import Paper

    check_new_target(arguments.print_board, ".pdf", "the board is written as PDF")
    paper = Paper[arguments.paper.upper()]
    write_target(arguments.print_board, pdf_document([board_sheet(board, paper)], paper))
    if arguments.json:
        file = {"file": str(arguments.print_board), "paper": arguments.paper}
        emit_json({**file, "board": board_report(board)})
        return
    size = f"{board.columns}x{board.rows} squares of {board.square_mm:g} mm"
    emit(f"{arguments.print_board}: {board.kind}, {size}.")
    emit("Print at 100 %, not fitted to the page, and measure the ruler below: 100 mm.")
    emit("Glue it to something stiff and flat, then measure ten squares and divide.")


def _calibrate_folder(arguments: argparse.Namespace, board: Board) -> None:
    from fieldcam.calibration.calibrating import calibrate, look
    from fieldcam.exchange.board_pairs import read_pair_folder
    from fieldcam.exchange.head_file import read_head

    if arguments.out is not None:
        _check_new(arguments.out)
    if arguments.camera:
        from fieldcam.store.folder import data_path

        take_pairs(arguments.folder, board, arguments.views, data_path(arguments.data))
    found, serials = read_pair_folder(arguments.folder), read_head(arguments.folder)
    for problem in found.problems:
        narrate(problem.text)
    out = arguments.out or _next_in_use(arguments)
    pairs = progress(_pairs(found), len(found.pairs), "pair")
    result = calibrate(board, look(board, pairs))
    _write(out, result, serials)
    if arguments.out is None:
        narrate("The app uses it from now on.")
    _tell(arguments, result, out)


def _check_new(out: Path) -> None:
    """What cannot be written to is found out before the work, not after."""
    if out.exists():
        raise BadInput(
            f"{out} is there already, and no calibration is written over.",
            "Name a new folder with --out.",
        )


def _next_in_use(arguments: argparse.Namespace) -> Path:
    """Where the app looks for the newest calibration."""
    from fieldcam.store.calibrations import next_calibration
    from fieldcam.store.folder import DataKind, data_path, open_data_folder

    data = open_data_folder(data_path(arguments.data), DataKind.FIELD)
    return next_calibration(data.path, datetime.now(UTC).astimezone().date())


def _pairs(found: PairFolder) -> Iterator[BoardPair]:
    from fieldcam.calibration.calibrating import BoardPair
    from fieldcam.exchange.images import read_pair

    for paths in found.pairs:
        yield BoardPair(paths.name, *read_pair(paths.left, paths.right))


def _write(out: Path, result: Calibrated, serials: tuple[str, str] | None) -> None:
    from fieldcam.calibration.written import calibration_files
    from fieldcam.disk.durable import write_folder_durably
    from fieldcam.exchange.calibration_report import calibration_report
    from fieldcam.exchange.images import encode_png
    from fieldcam.report.coverage_picture import draw_coverage

    report = json.dumps(calibration_report(result), indent=1, allow_nan=False)
    files = {
        **calibration_files(result.camera, result.rig, serials),
        REPORT_NAME: report.encode("ascii") + b"\n",
        PICTURE_NAME: encode_png(draw_coverage(result)),
    }
    write_folder_durably(out, files)


def _tell(arguments: argparse.Namespace, result: Calibrated, out: Path) -> None:
    from fieldcam.exchange.calibration_report import calibration_report

    if arguments.json:
        emit_json({"out": str(out), **calibration_report(result)})
        return
    for line in table(_rows(result), "<>>>>><"):
        emit(line)
    emit("")
    for line in _summary(result):
        emit(line)
    emit(f"Written to {out}.")


def _rows(result: Calibrated) -> list[list[str]]:
    rows = [["view", "left px", "right px", "rows px", "range mm", "tilt", "used"]]
    for each in result.views:
        judged = each.judged
        errors = (judged.left_rms_px, judged.right_rms_px, each.rows_px)
        held = (f"{judged.pose.range_mm:.0f}", f"{judged.pose.tilt_deg:.0f}°")
        used = f"no: {judged.why_dropped}" if judged.why_dropped else "yes"
        rows.append([judged.view.name, *(f"{error:.2f}" for error in errors), *held, used])
    rows += [[each.name, "-", "-", "-", "-", "-", f"no: {each.why}"] for each in result.unseen]
    return rows


def _summary(result: Calibrated) -> Iterator[str]:
    camera, (left, right) = result.rig.rectified, (result.camera.left, result.camera.right)
    used, taken = len(result.kept), len(result.views) + len(result.unseen)
    yield f"{used} of {taken} pairs count; corners are {result.rms_px:.2f} px off (median view)."
    yield (
        f"Baseline {result.camera.baseline_mm:.2f} mm, focal length {camera.focal_px:.1f} px;"
        f" eyes {left.camera_matrix[0, 0]:.1f} and {right.camera_matrix[0, 0]:.1f} px."
    )
    yield f"Rectified, the eyes' rows are {result.rows_px:.2f} px apart."
    yield from (f"Warning: {warning}" for warning in result.warnings)
