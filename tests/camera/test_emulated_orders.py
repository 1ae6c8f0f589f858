"""The emulated camera by hand: a command with a head plugged in, and orders while it runs."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import pytest
from emulated_camera import plugged_bus
from emulated_camera.bus import UsbBus
from emulated_camera.clocks import SteppedClock
from emulated_camera.descriptors import Speed
from emulated_camera.faults import Fault
from emulated_camera.orders import Orders
from emulated_camera.pictures import gradients
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import HEAD_SERIAL, Shape, StereoHead, stereo_head

ROOT = Path(__file__).resolve().parents[2]
RUN = (sys.executable, "-m", "tests.emulated_camera", "--gradients", "--usb2")
CLIENT = """
import os, time, usb.core, usb.util
devices = lambda: list(usb.core.find(find_all=True))
(device,) = devices()
print(usb.util.get_string(device, device.iSerialNumber), device.speed)
with open(os.environ["EMULATED_CAMERA"], "w") as orders:
    orders.write("unplug\\n")
until = time.monotonic() + 20
while devices():
    assert time.monotonic() < until
raise SystemExit(9)
"""


@pytest.fixture
def head() -> StereoHead:
    found = stereo_head(
        UsbBus(SteppedClock()),
        Shape.SIDE_BY_SIDE,
        gradients(64, 48, 8),
        Sensor(width_px=64, height_px=48),
    )
    found.plug()
    return found


@pytest.fixture
def nexts() -> list[str]:
    return []


@pytest.fixture
def orders(head: StereoHead, nexts: list[str], tmp_path: Path) -> Iterator[Orders]:
    with closing(Orders(tmp_path / "orders", head, lambda: nexts.append("next"))) as found:
        yield found


def test_orders_plug_and_arm(orders: Orders, head: StereoHead, nexts: list[str]) -> None:
    bus, camera = head.head.bus, head.cameras[0]
    orders.carry_out("unplug")
    assert not bus.plugged
    orders.carry_out("plug usb2")
    assert [plugged.speed for plugged in bus.plugged] == [Speed.HIGH]
    orders.carry_out("dark 2")
    assert [camera.faults.strikes(Fault.DARK) for _ in range(3)] == [True, True, False]
    orders.carry_out("next")
    assert nexts == ["next"]
    with pytest.raises(ValueError, match="bogus"):
        orders.carry_out("bogus")


def test_addresses_have_seven_bits_and_no_two_devices_share_one(head: StereoHead) -> None:
    bus = head.head.bus
    hub = stereo_head(bus, Shape.SIDE_BY_SIDE, gradients(64, 48, 8), Sensor()).cameras[0]
    (first,) = bus.plugged
    addresses = []
    for _ in range(300):
        addresses.append(bus.plug(hub).address)
        bus.unplug(hub)
    assert addresses[:124] == [*range(3, 127)]
    assert set(addresses) == {*range(2, 128)} - {first.address}
    assert all(one != other for one, other in pairwise(addresses))


def test_without_the_preload_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plugged_bus, "PRELOAD", Path("/nowhere/preload.so"))
    reason = plugged_bus.why_not()
    assert reason
    assert "apt install umockdev" in reason


def test_a_command_runs_with_the_head_plugged_in() -> None:
    if reason := plugged_bus.why_not():
        pytest.skip(reason)
    done = subprocess.run(
        [*RUN, "--shape", "side-by-side", "--", sys.executable, "-c", CLIENT],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.stdout, done.returncode) == (f"{HEAD_SERIAL} 3\n", 9), done.stderr


WAITING = "import os, time; print(os.environ['UMOCKDEV_DIR'], flush=True); time.sleep(60)"


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGTERM])
def test_a_closed_terminal_leaves_no_folder_behind(number: signal.Signals) -> None:
    if reason := plugged_bus.why_not():
        pytest.skip(reason)
    with subprocess.Popen(
        [*RUN, "--", sys.executable, "-c", WAITING], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        root = Path(process.stdout.readline().strip())
        assert root.is_dir()
        process.send_signal(number)
        assert process.wait(20) == 128 + number
    assert not root.exists()
