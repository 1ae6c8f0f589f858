"""Runs a command on a machine with an emulated USB stereo head plugged in.

    python -m tests.emulated_camera [OPTIONS] -- COMMAND ...

    python -m tests.emulated_camera -- lsusb -v
    python -m tests.emulated_camera -- arv-tool-0.8 values
    python -m tests.emulated_camera --shape side-by-side -- fieldcam camera list

The command sees no other USB device. While it runs, write orders to the pipe that
$EMULATED_CAMERA names (`orders`), from the command itself or from another terminal:

    echo unplug > $EMULATED_CAMERA
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
from contextlib import closing, nullcontext
from types import FrameType

from fieldcam.errors import OF_SIGNALS

from .bus import UsbBus
from .descriptors import Speed
from .orchard import Orchard
from .orders import Orders
from .pictures import gradients
from .plugged_bus import PluggedBus, why_not
from .sensor import Sensor
from .shapes import Shape, stereo_head

MISUSED = 2


def main() -> int:
    options = _options()
    for number in (signal.SIGHUP, signal.SIGTERM):
        signal.signal(number, _end)
    if reason := why_not():
        sys.stderr.write(f"{reason}\n")
        return MISUSED
    with _scenery(options) as scenery, PluggedBus(UsbBus()) as served:
        source = scenery or gradients(1440, 1080)
        head = stereo_head(served.bus, options.shape, source, Sensor())
        head.plug(Speed.HIGH if options.usb2 else Speed.SUPER)
        go_on = scenery.go_on if scenery else lambda: None
        with closing(Orders(served.root / "orders", head, go_on)) as orders:
            sys.stderr.write(f"emulated camera: orders go to {orders.path}\n")
            environment = {**served.environment, "EMULATED_CAMERA": str(orders.path)}
            return _run(options.command, environment)


def _run(command: list[str], environment: dict[str, str]) -> int:
    """Its exit code."""
    # Ctrl+C is for the command; this process has to outlive it.
    signal.signal(signal.SIGINT, lambda *_: None)
    try:
        return subprocess.run(command, env=environment).returncode
    except OSError as error:
        sys.stderr.write(f"{command[0]}: {error.strerror}\n")
        return MISUSED


def _end(number: int, frame: FrameType | None) -> None:
    """A closed terminal ends the command too, and leaves no folder behind."""
    sys.exit(OF_SIGNALS + number)


def _scenery(options: argparse.Namespace) -> closing[Orchard] | nullcontext[None]:
    if options.gradients:
        return nullcontext()
    sys.stderr.write("emulated camera: rendering the orchard\n")
    return closing(Orchard(options.seed, options.clusters, options.day))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.emulated_camera")
    parser.add_argument("--shape", type=Shape, choices=list(Shape), default=Shape.TWO_DEVICES)
    parser.add_argument("--usb2", action="store_true", help="plug it into a USB 2 port")
    parser.add_argument("--gradients", action="store_true", help="no orchard, a test picture")
    parser.add_argument("--seed", type=int, default=5, help="of the simulated block")
    parser.add_argument("--clusters", type=int, default=3, help="of the simulated block")
    parser.add_argument("--day", type=int, default=0, help="of the simulated block")
    parser.add_argument("command", nargs="+", metavar="COMMAND")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
