"""`fieldcam camera`: what is attached, what it can be set to, and one picture from it."""

from __future__ import annotations

import argparse
from pathlib import Path

import fieldcam
from fieldcam.cli.arguments import Parser, Subparsers, add_command, add_json
from fieldcam.cli.cameras import features, grab, probe
from fieldcam.cli.cameras.listing import camera_entry, camera_lines
from fieldcam.cli.console import emit, emit_json, narrate

GROUPS = (probe, grab, features)
RULE = Path(fieldcam.__file__).parent / "systemd/60-fieldcam-camera.rules"
NONE = "No USB3 Vision camera is attached."


def register(commands: Subparsers[Parser]) -> None:
    parser = commands.add_parser("camera", help="cameras and what they can be set to")
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    add_json(add_command(actions, "list", "list the USB3 Vision cameras that are attached", _list))
    add_command(actions, "rule", "print the udev rule that lets you use the camera", _rule)
    for group in GROUPS:
        group.register(actions)


def _list(arguments: argparse.Namespace) -> None:
    from fieldcam.camera.usb3vision.devices import attached_cameras

    cameras = attached_cameras()
    if arguments.json:
        emit_json({"cameras": [camera_entry(camera) for camera in cameras]})
    else:
        emit("\n\n".join("\n".join(camera_lines(camera)) for camera in cameras) or NONE)
    if not cameras:
        narrate("`fieldcam camera probe` shows other USB devices that could be one.")


def _rule(arguments: argparse.Namespace) -> None:
    emit(RULE.read_text(encoding="utf-8").rstrip())
