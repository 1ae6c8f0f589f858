"""The emulated camera behind real libusb and real pyusb, in processes of their own."""

from __future__ import annotations

import random
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from emulated_camera.bus import UsbBus
from emulated_camera.descriptors import Speed
from emulated_camera.faults import ALWAYS, Fault
from emulated_camera.pictures import gradients
from emulated_camera.plugged_bus import PluggedBus, why_not
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import HEAD_SERIAL, LEFT_SERIAL, RIGHT_SERIAL, Shape, stereo_head
from emulated_camera.uevents import murmur_hash
from emulated_camera.usbfs import IN_PIECES, WHOLE

TESTS = Path(__file__).parents[1]
OPEN_FILES = Path("/proc/self/fd")
SOURCE = gradients(1440, 1080)
PATIENCE_S = 60


class Client:
    """A script in a process under the preload; it and the test take turns, line by line."""

    def __init__(self, served: PluggedBus, script: str) -> None:
        environment = {**served.environment, "PYTHONPATH": str(TESTS)}
        self._process = subprocess.Popen(
            [sys.executable, "-u", "-c", PREAMBLE + script],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def line(self) -> str:
        """What it prints next."""
        assert self._process.stdout
        return self._process.stdout.readline().strip()

    def go_on(self) -> None:
        assert self._process.stdin
        self._process.stdin.write("\n")
        self._process.stdin.flush()

    def ended(self) -> int:
        self._process.communicate(timeout=PATIENCE_S)
        return self._process.returncode

    def kill(self) -> None:
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()


PREAMBLE = """
import errno, os, time
import usb.core, usb.util
from plain_host import cameras

def error_of(act):
    try:
        act()
    except usb.core.USBError as error:
        return errno.errorcode[error.errno]

def await_devices(count):
    until = time.monotonic() + 20
    while len(list(usb.core.find(find_all=True))) != count:
        assert time.monotonic() < until
"""


@contextmanager
def client(served: PluggedBus, script: str) -> Iterator[Client]:
    running = Client(served, script)
    try:
        yield running
    finally:
        running.kill()


def answer(served: PluggedBus, script: str) -> str:
    """All that a script prints."""
    with client(served, script) as running:
        lines = iter(running.line, "")
        return "\n".join(lines)


def test_libusb_finds_two_devices_and_reads_their_registers(served_bus: PluggedBus) -> None:
    stereo_head(served_bus.bus, Shape.TWO_DEVICES, SOURCE, Sensor()).plug()
    script = """
for host in cameras():
    special = host.device.get_active_configuration().interfaces()[0].extra_descriptors
    print(host.serial, host.device.speed, bytes(special)[:3].hex(), host.read(0x44, 64)[:9])
"""
    assert answer(served_bus, script).splitlines() == [
        f"{serial} 4 142401 b'Flash Eye'" for serial in (LEFT_SERIAL, RIGHT_SERIAL)
    ]


@pytest.mark.parametrize("capabilities", [WHOLE, IN_PIECES], ids=["whole", "pieces"])
def test_a_triggered_pair_arrives_whole(capabilities: int, tmp_path: Path) -> None:
    if reason := why_not():
        pytest.skip(reason)
    script = f"""
(host,) = cameras()
host.learn()
host.put("ExposureAuto", 0)
host.put("TriggerMode", 1)
host.put("LineMode", 1, 1)
host.put("LineSource", 1, 1)
host.put("ExposureTime", 300.0)
host.stream()
host.put("AcquisitionStart", 1)
for ordinal in range(3):
    host.put("TriggerSoftware", 1)
    block = host.block()
    print(block.block_id, block.status, block.valid, len(block.payload))
open({str(tmp_path / "payload")!r}, "wb").write(block.payload)
"""
    with PluggedBus(UsbBus(), capabilities) as served:
        stereo_head(served.bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor()).plug()
        lines = answer(served, script).splitlines()
    assert lines == [f"{ordinal} 0 3110400 3110400" for ordinal in range(3)]
    both = np.frombuffer((tmp_path / "payload").read_bytes(), np.uint8).reshape(1080, 2880)
    assert np.abs(both.astype(int) - np.hstack(SOURCE(2))).max() <= 6


def test_unplugging_in_mid_frame_and_plugging_in_again(served_bus: PluggedBus) -> None:
    head = stereo_head(served_bus.bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor())
    head.plug()
    head.cameras[0].faults.arm(Fault.UNPLUG_MID_FRAME)
    script = """
(host,) = cameras()
host.stream()
host.learn()
host.put("AcquisitionStart", 1)
print(error_of(host.block))
host.close()
await_devices(0)
print("gone")
input()
await_devices(1)
(again,) = cameras()
print(again.serial, again.device.address - host.device.address)
again.learn()
again.stream()
again.put("AcquisitionStart", 1)
print(again.block().status)
"""
    with client(served_bus, script) as running:
        assert running.line() == "ENODEV"
        assert running.line() == "gone"
        head.plug()
        running.go_on()
        assert running.line() == f"{HEAD_SERIAL} 1"
        assert running.line() == "0"
        assert running.ended() == 0


def test_every_program_hears_what_is_plugged_in(served_bus: PluggedBus) -> None:
    head = stereo_head(served_bus.bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor())
    script = """
await_devices(0)
print("listens")
await_devices(1)
print("heard")
"""
    with client(served_bus, script) as first:
        assert first.line() == "listens"
        # It has the same number for its socket, and takes the other's name.
        with client(served_bus, script) as second:
            assert second.line() == "listens"
            head.plug()
            assert (first.line(), second.line()) == ("heard", "heard")


def test_what_the_kernel_would_refuse(served_bus: PluggedBus) -> None:
    bus = served_bus.bus
    for port, fault in enumerate((Fault.IN_USE, Fault.KERNEL_DRIVER)):
        camera = stereo_head(bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor()).cameras[0]
        camera.faults.arm(fault, ALWAYS)
        assert bus.plug(camera).port == port + 1
    locked = stereo_head(bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor()).cameras[0]
    bus.plug(locked, Speed.HIGH, permitted=False)
    script = """
devices = sorted(usb.core.find(find_all=True), key=lambda device: device.port_numbers)
for device in devices:
    print(device.speed, error_of(lambda: usb.util.claim_interface(device, 0)))
print(devices[1].is_kernel_driver_active(0))
devices[1].detach_kernel_driver(0)
usb.util.claim_interface(devices[1], 0)
"""
    assert answer(served_bus, script).splitlines() == ["4 EBUSY", "4 EBUSY", "3 EACCES", "True"]


def test_what_one_program_holds_no_other_can_claim(served_bus: PluggedBus) -> None:
    stereo_head(served_bus.bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor()).plug()
    hold = """
(host,) = cameras()
usb.util.claim_interface(host.device, 0)
print(host.serial)
input()
usb.util.release_interface(host.device, 2)
print("released")
input()
"""
    ask = """
(device,) = usb.core.find(find_all=True)
print(usb.util.get_string(device, device.iSerialNumber))
print(device.is_kernel_driver_active(0))
for number in range(3):
    print(error_of(lambda: usb.util.claim_interface(device, number)))
"""
    held = [HEAD_SERIAL, "False", "EBUSY", "EBUSY"]
    with client(served_bus, hold) as holder:
        assert holder.line() == HEAD_SERIAL
        assert answer(served_bus, ask).splitlines() == [*held, "EBUSY"]
        holder.go_on()
        assert holder.line() == "released"
        assert answer(served_bus, ask).splitlines() == [*held, "None"]
    served_bus.wait_for_clients()
    assert answer(served_bus, ask).splitlines() == [HEAD_SERIAL, "False", *["None"] * 3]


@pytest.mark.parametrize(
    ("fault", "expected"),
    [(Fault.STALL, "EPIPE"), (Fault.BABBLE, "EOVERFLOW"), (Fault.LINK_ERROR, "EIO")],
)
def test_faults_reach_pyusb_as_its_errors(
    served_bus: PluggedBus, fault: Fault, expected: str
) -> None:
    head = stereo_head(served_bus.bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor())
    head.plug()
    head.cameras[0].faults.arm(fault)
    script = """
(host,) = cameras()
host.learn()
host.stream()
host.put("AcquisitionStart", 1)
print(error_of(host.block))
host.put("AcquisitionStop", 1)
host.device.ctrl_transfer(0x02, 0x03, 0, 0x83)
host.device.clear_halt(0x83)
host.put("AcquisitionStart", 1)
print(host.block().status)
"""
    assert answer(served_bus, script).splitlines() == [expected, "0"]


def test_transfers_above_the_kernels_memory_are_refused() -> None:
    if reason := why_not():
        pytest.skip(reason)
    script = """
(host,) = cameras()
print(error_of(lambda: host.transfer(1 << 20)), host.number(0x1CC))
"""
    with PluggedBus(UsbBus(), limit_bytes=1 << 19) as served:
        stereo_head(served.bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor()).plug()
        # libusb 1.0.26 tells EIO for any error of submitting but a lost device.
        assert answer(served, script) in ("EIO 100", "ENOMEM 100")


def test_a_client_that_is_killed_leaves_nothing_behind(served_bus: PluggedBus) -> None:
    stereo_head(served_bus.bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor()).plug()
    before = threading.active_count()
    with client(served_bus, "(host,) = cameras()\nprint(host.serial)\ninput()") as running:
        assert running.line() == HEAD_SERIAL
        assert threading.active_count() == before + 1
    served_bus.wait_for_clients()
    assert threading.active_count() == before
    assert answer(served_bus, "print(cameras()[0].serial)") == HEAD_SERIAL


CYCLES = 20
AGAIN_AND_AGAIN = f"""
for cycle in range({CYCLES}):
    await_devices(1)
    try:
        (host,) = cameras()
        print("open")
        host.learn()
        host.stream()
        host.put("AcquisitionStart", 1)
        while True:
            host.block()
    except usb.core.USBError as error:
        name = errno.errorcode[error.errno]
    host.close()
    await_devices(0)
    print(name)
    input()
print(len(os.listdir("/proc/self/fd")) < 20)
"""


def test_pulling_the_plug_at_any_moment_leaves_nothing_behind(served_bus: PluggedBus) -> None:
    head = stereo_head(served_bus.bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor())
    head.plug()
    before = threading.active_count(), len(list(OPEN_FILES.iterdir()))
    rng = random.Random(7)
    with client(served_bus, AGAIN_AND_AGAIN) as running:
        for _ in range(CYCLES):
            assert running.line() == "open"
            pulled = threading.Timer(rng.uniform(0, 0.15), head.unplug)
            pulled.start()
            assert running.line() == "ENODEV"
            pulled.join()
            head.plug()
            running.go_on()
        assert running.line() == "True"
        assert running.ended() == 0
        served_bus.wait_for_clients()
        threads = threading.active_count()
    assert (threads, len(list(OPEN_FILES.iterdir()))) == before


@pytest.mark.parametrize(
    ("text", "expected"), [(b"usb", 91735525), (b"usb_device", 670627084), (b"tty", 2331676872)]
)
def test_the_hash_is_the_one_that_libudev_filters_by(text: bytes, expected: int) -> None:
    # Computed with umockdev's own function.
    assert murmur_hash(text) == expected


SECONDS = 60
RATE = f"""
import array, threading

COUNT = 30 * {SECONDS}
last = []

def run(host):
    into = [array.array("B", bytes(size)) for size in (1024, *host.sizes, 1024)]
    for _ in range(COUNT):
        got = [host.device.read(0x83, buffer, 5000) for buffer in into]
        assert into[0][:4].tobytes() == b"U3VL" and into[-1][:4].tobytes() == b"U3VT"
        assert sum(got[1:-1]) == int.from_bytes(into[-1][20:28], "little")
    last.append(int.from_bytes(into[0][8:16], "little"))

hosts = cameras()
for host in hosts:
    host.learn()
    host.put("AcquisitionFrameRate", 30.0)
    host.put("ExposureAuto", 0)
    host.stream()
for host in hosts:
    host.put("AcquisitionStart", 1)
started = time.monotonic()
threads = [threading.Thread(target=run, args=(host,)) for host in hosts]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
took = time.monotonic() - started
assert len(last) == len(hosts)
print(COUNT / took, COUNT * 3.1104 / took, max(last) + 1 - COUNT)
"""


@pytest.mark.slow
@pytest.mark.parametrize("shape", [Shape.TWO_DEVICES, Shape.SIDE_BY_SIDE])
def test_thirty_pairs_a_second_for_a_minute(
    served_bus: PluggedBus, shape: Shape, note: Callable[[str], None]
) -> None:
    stereo_head(served_bus.bus, shape, SOURCE, Sensor()).plug()
    pairs, megabytes, lost = map(float, answer(served_bus, RATE).split())
    note(f"{shape}: {pairs:.2f} pairs/s, {megabytes:.1f} MB/s through libusb, {lost:.0f} lost")
    assert pairs > 29.9
    assert lost == 0
