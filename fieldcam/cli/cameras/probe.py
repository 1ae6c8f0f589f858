"""`fieldcam camera probe`: all that USB devices tell about themselves, for a bundle to send."""

from __future__ import annotations

import argparse
from pathlib import Path

from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json
from fieldcam.cli.cameras.chosen import add_serial, choose_cameras
from fieldcam.cli.cameras.report import Findings, document, lines
from fieldcam.cli.console import emit, emit_json, narrate


def register(actions: Subparsers[Parser]) -> None:
    summary = "tell all that USB cameras say about themselves, unknown ones too"
    parser = add_command(actions, "probe", summary, _probe)
    add_serial(parser)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="ZIP",
        help="write a bundle for somebody who writes a driver; holds serial numbers",
    )
    add_json(parser)


def _probe(arguments: argparse.Namespace) -> None:
    from fieldcam.disk.targets import check_new_target, write_target

    if arguments.out is not None:
        check_new_target(arguments.out, ".zip", "the bundle is a zip archive")
    findings = _look(arguments.serial)
    if arguments.json:
        emit_json(document(findings))
    else:
        for line in lines(findings):
            emit(line)
    if arguments.out is not None:
        from fieldcam.cli.cameras.bundle import bundle

        write_target(arguments.out, bundle(findings))
        narrate(f"{arguments.out} is written; the README.txt in it says what to send with it.")


def _look(serial: str | None) -> Findings:
    from fieldcam.camera.usb3vision.description import cache_folder
    from fieldcam.camera.usb3vision.probing import CameraReport, probe_camera
    from fieldcam.camera.usb3vision.survey import survey_bus

    reports: list[CameraReport] = []
    for camera in choose_cameras(serial):
        narrate(f"Asking the camera in USB socket {camera.port}.")
        reports.append(probe_camera(camera, cache_folder()))
    return Findings(survey_bus(), tuple(reports))
