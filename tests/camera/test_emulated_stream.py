"""The emulated camera's pictures: three shapes of stereo, the flash, and what can go wrong."""

from __future__ import annotations

import errno
import struct
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
import usb.core
from emulated_camera.backend import EmulatedBackend
from emulated_camera.bus import UsbBus
from emulated_camera.clocks import SteppedClock
from emulated_camera.descriptors import Speed
from emulated_camera.faults import Fault
from emulated_camera.pictures import NOMINAL_US, gradients
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import Shape, StereoHead, stereo_head
from plain_host import EVENTS, NotDone, PlainHost, cameras

WIDTH, HEIGHT, DISPARITY = 1440, 1080, 96
SOURCE = gradients(WIDTH, HEIGHT, DISPARITY)
LINE1, LINE2 = 1, 2
Image = npt.NDArray[np.uint8]


def opened(shape: Shape, eye: Sensor | None = None) -> tuple[StereoHead, list[PlainHost]]:
    bus = UsbBus(SteppedClock())
    head = stereo_head(bus, shape, SOURCE, eye or Sensor())
    head.plug()
    hosts = cameras(EmulatedBackend(bus))
    for host in hosts:
        host.learn()
    return head, hosts


def triggered(host: PlainHost, source: int = 0) -> None:
    """Wait for this trigger, with a fixed exposure that suits the flash."""
    host.put("ExposureAuto", 0)
    host.put("ExposureTime", NOMINAL_US)
    host.put("TriggerSource", source)
    host.put("TriggerMode", 1)


def strobed(host: PlainHost) -> None:
    host.put("LineMode", 1, LINE1)
    host.put("LineSource", 1, LINE1)


def started(host: PlainHost) -> None:
    host.put("TLParamsLocked", 1)
    host.stream()
    host.put("AcquisitionStart", 1)


def ready(shape: Shape, eye: Sensor | None = None) -> tuple[StereoHead, list[PlainHost]]:
    """A head whose first camera waits for a software trigger and fires the flash."""
    head, hosts = opened(shape, eye)
    triggered(hosts[0])
    strobed(hosts[0])
    if len(hosts) > 1:
        hosts[0].put("LineMode", 1, LINE2)
        hosts[0].put("LineSource", 1, LINE2)
        triggered(hosts[1], source=1 + LINE2)
    for host in reversed(hosts):
        started(host)
    return head, hosts


def image(payload: bytes, width: int = WIDTH) -> Image:
    return np.frombuffer(payload, np.uint8, width * HEIGHT).reshape(HEIGHT, width)


def assert_pair(left: Image, right: Image, ordinal: int = 0) -> None:
    """The pictures of this exposure, with a positive disparity."""
    expected = SOURCE(ordinal)
    # The strobe's light and a little ambient light beside it.
    assert np.abs(left.astype(int) - expected[0]).max() <= 6
    assert np.array_equal(left[:, DISPARITY:], right[:, :-DISPARITY])


def test_one_trigger_fires_two_devices_over_the_wire() -> None:
    _, (left, right) = ready(Shape.TWO_DEVICES)
    for ordinal in range(3):
        left.put("TriggerSoftware", 1)
        blocks = left.block(), right.block()
        assert [block.block_id for block in blocks] == [ordinal, ordinal]
        assert [block.status for block in blocks] == [0, 0]
        assert blocks[0].valid == len(blocks[0].payload) == WIDTH * HEIGHT
        assert_pair(image(blocks[0].payload), image(blocks[1].payload), ordinal)


def test_both_eyes_beside_each_other_in_one_block() -> None:
    _, (host,) = ready(Shape.SIDE_BY_SIDE)
    host.put("TriggerSoftware", 1)
    block = host.block()
    assert (block.width, block.height) == (2 * WIDTH, HEIGHT)
    both = image(block.payload, 2 * WIDTH)
    assert_pair(both[:, :WIDTH], both[:, WIDTH:])


def test_two_components_alternate_and_share_a_timestamp() -> None:
    _, (host,) = opened(Shape.ALTERNATING)
    triggered(host)
    strobed(host)
    host.put("ChunkModeActive", 1)
    started(host)
    host.put("TriggerSoftware", 1)
    first, second = host.block(), host.block()
    assert (first.block_id, second.block_id) == (0, 1)
    assert first.timestamp_ns == second.timestamp_ns
    assert_pair(image(first.payload), image(second.payload))
    assert [chunks(b.payload)[0x0106] for b in (first, second)] == [
        struct.pack("<Q", 0),
        struct.pack("<Q", 1),
    ]


def chunks(payload: bytes) -> dict[int, bytes]:
    """All chunks, from the last to the first."""
    found = {}
    while payload:
        number, length = struct.unpack_from("<II", payload, len(payload) - 8)
        found[number] = payload[len(payload) - 8 - length : len(payload) - 8]
        payload = payload[: len(payload) - 8 - length]
    return found


def test_chunks_tell_of_the_exposure() -> None:
    _, (host,) = opened(Shape.SIDE_BY_SIDE)
    triggered(host)
    strobed(host)
    host.put("Gain", 60)
    host.put("ChunkModeActive", 1)
    for index in range(5):
        host.put("ChunkEnable", 1, index)
    started(host)
    host.put("TriggerSoftware", 1)
    block = host.block()
    assert len(block.payload) == block.valid == host.get("PayloadSize")
    found = chunks(block.payload)
    assert len(found[0x0001]) == 2 * WIDTH * HEIGHT
    assert struct.unpack("<Q", found[0x0101]) == (block.block_id,)
    assert struct.unpack("<Q", found[0x0102]) == (block.timestamp_ns,)
    assert struct.unpack("<d", found[0x0103]) == (NOMINAL_US,)
    assert struct.unpack("<d", found[0x0104]) == (6.0,)
    assert struct.unpack("<Q", found[0x0105]) == (1 << LINE1,)


def brightness(change: Callable[[PlainHost], None]) -> float:
    """Mean of a triggered picture after this change of settings."""
    _, (host,) = opened(Shape.SIDE_BY_SIDE)
    triggered(host)
    strobed(host)
    change(host)
    started(host)
    host.put("TriggerSoftware", 1)
    return float(image(host.block().payload, 2 * WIDTH).mean())


def test_exposure_gain_black_level_and_strobe_act_on_the_picture() -> None:
    normal = brightness(lambda host: None)
    assert brightness(lambda host: host.put("ExposureTime", 150.0)) == pytest.approx(
        normal / 2, rel=0.02
    )
    assert brightness(lambda host: host.put("Gain", 60)) > 1.6 * normal
    assert brightness(lambda host: host.put("BlackLevel", 160)) == pytest.approx(normal + 10, 0.01)
    assert brightness(lambda host: host.put("LineMode", 0, LINE1)) < 0.03 * normal
    assert brightness(lambda host: host.put("LineSource", 0, LINE1)) < 0.03 * normal
    assert brightness(timed_strobe) == pytest.approx(normal / 3, rel=0.06)


def timed_strobe(host: PlainHost) -> None:
    host.put("LineSource", 2, LINE1)
    host.put("TimerTriggerSource", 1)
    host.put("TimerDuration", 100.0)


def test_white_balance_acts_on_its_own_colour() -> None:
    _, (host,) = opened(Shape.SIDE_BY_SIDE)
    triggered(host)
    strobed(host)
    host.put("BalanceRatio", 512, 0)
    started(host)
    host.put("TriggerSoftware", 1)
    picture = image(host.block().payload, 2 * WIDTH)
    red, green, blue = picture[0::2, 0::2], picture[0::2, 1::2], picture[1::2, 1::2]
    assert red.mean() == pytest.approx(green.mean() / 2, rel=0.03)
    assert blue.mean() == pytest.approx(green.mean(), rel=0.03)


def test_a_region_of_interest_is_cut_out() -> None:
    _, (host, _) = opened(Shape.TWO_DEVICES)
    triggered(host)
    strobed(host)
    for name, value in (("Width", 1024), ("Height", 1024), ("OffsetX", 200), ("OffsetY", 30)):
        host.put(name, value)
    started(host)
    host.put("TriggerSoftware", 1)
    block = host.block()
    found = np.frombuffer(block.payload, np.uint8).reshape(1024, 1024)
    expected = SOURCE(0)[0][30:1054, 200:1224].astype(int)
    assert np.abs(found - expected).max() <= 6


def test_without_a_trigger_it_runs_at_its_frame_rate() -> None:
    _, (host,) = opened(Shape.SIDE_BY_SIDE)
    host.put("AcquisitionFrameRate", 20.0)
    host.put("ExposureAuto", 0)
    started(host)
    blocks = [host.block() for _ in range(4)]
    assert [block.block_id for block in blocks] == [0, 1, 2, 3]
    assert np.diff([block.timestamp_ns for block in blocks]) == pytest.approx([50e6] * 3)
    host.put("AcquisitionStop", 1)
    host.put("AcquisitionStart", 1)
    while (again := host.block().block_id) > 3:
        pass
    assert again == 0


def test_a_trigger_while_busy_is_not_seen() -> None:
    head, (host,) = ready(Shape.SIDE_BY_SIDE)
    host.put("TriggerSoftware", 1)
    host.put("TriggerSoftware", 1)
    assert host.block().block_id == 0
    with pytest.raises(usb.core.USBTimeoutError):
        host.block()
    assert head.cameras[0].shutter.missed == 1


def test_what_a_slow_host_does_not_fetch_is_lost_with_its_id() -> None:
    _, (host,) = opened(Shape.SIDE_BY_SIDE, Sensor(blocks_kept=2))
    host.put("AcquisitionFrameRate", 100.0)
    started(host)
    with pytest.raises(usb.core.USBTimeoutError):
        host.transfer(64, EVENTS)
    ids = [host.block().block_id for _ in range(3)]
    assert ids[:2] == [0, 1]
    assert ids[2] > 100


def test_clocks_drift_apart() -> None:
    clock = SteppedClock()
    bus = UsbBus(clock)
    latched = []
    for ppm in (0.0, 50.0):
        camera = stereo_head(bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor(drift_ppm=ppm)).cameras[0]
        bus.plug(camera)
        (host,) = cameras(EmulatedBackend(bus))
        host.learn()
        with bus.changed:
            clock.wait(bus.changed, 10_000_000_000)
        host.put("TimestampLatch", 1)
        latched.append(host.get("TimestampLatchValue"))
        assert host.number(0x1F0, 8) == latched[-1]
        bus.unplug(camera)
    assert latched[1] - latched[0] == pytest.approx(500_000, rel=0.01)


def test_usb_2_takes_its_time() -> None:
    bus = UsbBus(SteppedClock())
    head = stereo_head(bus, Shape.SIDE_BY_SIDE, SOURCE, Sensor())
    bus.plug(head.cameras[0], Speed.HIGH)
    (host,) = cameras(EmulatedBackend(bus))
    host.learn()
    triggered(host)
    started(host)
    before_ns = bus.clock.now_ns()
    host.put("TriggerSoftware", 1)
    host.block()
    assert 0.07 < (bus.clock.now_ns() - before_ns) / 1e9 < 0.12


@pytest.mark.parametrize("limited", [False, True], ids=["the link is slow", "it is told to be"])
def test_a_slow_link_takes_its_time(limited: bool) -> None:
    head, (host,) = opened(Shape.SIDE_BY_SIDE, Sensor(bytes_per_s=None if limited else 10e6))
    triggered(host)
    if limited:
        host.put("DeviceLinkThroughputLimitMode", 1)
        host.put("DeviceLinkThroughputLimit", 10_000_000)
    started(host)
    before_ns = head.head.now_ns()
    host.put("TriggerSoftware", 1)
    host.block()
    assert 0.31 < (head.head.now_ns() - before_ns) / 1e9 < 0.33


def test_a_slow_camera_answers_late() -> None:
    head, (host,) = opened(Shape.SIDE_BY_SIDE, Sensor(ack_ms=80))
    before_ns = head.head.now_ns()
    host.read(0x1CC, 4)
    assert 0.08 <= (head.head.now_ns() - before_ns) / 1e9 < 0.09


def test_a_single_frame_is_one() -> None:
    _, (host,) = opened(Shape.SIDE_BY_SIDE)
    host.put("AcquisitionMode", 0)
    started(host)
    assert host.block().block_id == 0
    with pytest.raises(usb.core.USBTimeoutError):
        host.block()


@pytest.mark.parametrize(
    ("offset", "value", "status"),
    [(0x1C, 1000, "A003"), (0x20, 0, "A004"), (0x18, 16, "A004"), (0x2C, 16, "A004")],
)
def test_transfer_sizes_that_do_not_fit_are_refused(offset: int, value: int, status: str) -> None:
    _, (host,) = opened(Shape.SIDE_BY_SIDE)
    host.stream()
    sirm = host.number(host.number(0x1D8, 8) + 0x20, 8)
    host.write(sirm + 4, 0)
    host.write(sirm + offset, value)
    with pytest.raises(NotDone, match=status):
        host.write(sirm + 4, 1)


def transfers(host: PlainHost) -> list[int | bytes]:
    """Of one frame until nothing more comes: lengths, the first bytes of short ones, errnos."""
    found: list[int | bytes] = []
    while True:
        try:
            piece = host.transfer(1 << 20)
        except usb.core.USBTimeoutError:
            return found
        except usb.core.USBError as error:
            found.append(-(error.errno or 0))
            if error.errno != errno.EPIPE:
                continue
            return found
        found.append(len(piece) if len(piece) > 64 else piece[:4])


MIB = 1 << 20
REST = 2 * WIDTH * HEIGHT - 2 * MIB


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        (None, [b"U3VL", MIB, MIB, REST, b"U3VT"]),
        (Fault.NO_LEADER, [MIB, MIB, REST, b"U3VT"]),
        (Fault.NO_TRAILER, [b"U3VL", MIB, MIB, REST]),
        (Fault.SHORT_FRAME, [b"U3VL", MIB, MIB, REST - 4096, b"U3VT"]),
        (Fault.LONG_FRAME, [b"U3VL", MIB, MIB, REST, 1024, b"U3VT"]),
        (Fault.BABBLE, [b"U3VL", MIB, -errno.EOVERFLOW, REST, b"U3VT"]),
        (Fault.LINK_ERROR, [b"U3VL", MIB, -errno.EIO, REST, b"U3VT"]),
        (Fault.STALL, [b"U3VL", MIB, -errno.EPIPE]),
        (Fault.MAGIC_IN_PAYLOAD, [b"U3VL", MIB, MIB, REST, b"U3VT"]),
        (Fault.BLOCK_GAP, []),
        (Fault.SILENT, []),
    ],
)
def test_faults_of_the_stream(fault: Fault | None, expected: list[int | bytes]) -> None:
    head, (host,) = ready(Shape.SIDE_BY_SIDE)
    if fault:
        head.cameras[0].faults.arm(fault)
    host.put("TriggerSoftware", 1)
    assert transfers(host) == expected
    assert host.get("LinkErrorCount") == (1 if fault is Fault.LINK_ERROR else 0)
    if fault is Fault.STALL:
        host.device.clear_halt(0x83)
    host.put("TriggerSoftware", 1)
    assert host.block().block_id == (0 if fault is Fault.SILENT else 1)


@pytest.mark.parametrize(("fault", "status"), [(Fault.DISCARDED, 0xA100), (Fault.OVERRUN, 0xA101)])
def test_the_trailer_says_what_the_camera_lost(fault: Fault, status: int) -> None:
    head, (host,) = ready(Shape.SIDE_BY_SIDE)
    head.cameras[0].faults.arm(fault)
    host.put("TriggerSoftware", 1)
    assert host.block().status == status


def test_a_leaders_magic_may_lie_in_the_payload() -> None:
    head, (host,) = ready(Shape.SIDE_BY_SIDE)
    head.cameras[0].faults.arm(Fault.MAGIC_IN_PAYLOAD)
    host.put("TriggerSoftware", 1)
    assert host.block().payload[MIB : MIB + 4] == b"U3VL"


def test_a_dark_frame_and_swapped_eyes() -> None:
    head, (host,) = ready(Shape.SIDE_BY_SIDE)
    host.put("TriggerSoftware", 1)
    good = image(host.block().payload, 2 * WIDTH)
    head.cameras[0].faults.arm(Fault.DARK)
    host.put("TriggerSoftware", 1)
    assert image(host.block().payload, 2 * WIDTH).mean() < 0.03 * good.mean()
    head.cameras[0].faults.arm(Fault.SWAPPED_EYES)
    host.put("TriggerSoftware", 1)
    both = image(host.block().payload, 2 * WIDTH)
    assert not np.array_equal(both[:, DISPARITY:WIDTH], both[:, WIDTH : 2 * WIDTH - DISPARITY])
    assert np.array_equal(both[:, : WIDTH - DISPARITY], both[:, WIDTH + DISPARITY :])


def test_one_eye_may_stay_silent() -> None:
    head, (left, right) = ready(Shape.TWO_DEVICES)
    head.cameras[1].faults.arm(Fault.SILENT)
    left.put("TriggerSoftware", 1)
    assert left.block().block_id == 0
    with pytest.raises(usb.core.USBTimeoutError):
        right.block()


@pytest.mark.parametrize("fault", [Fault.UNPLUG_MID_FRAME, Fault.BROWN_OUT])
def test_it_drops_off_the_bus(fault: Fault) -> None:
    head, (host,) = ready(Shape.SIDE_BY_SIDE)
    head.cameras[0].faults.arm(fault)
    before_ns = head.head.now_ns()
    host.put("TriggerSoftware", 1)
    with pytest.raises(usb.core.USBError) as caught:
        host.block()
    assert caught.value.errno == errno.ENODEV
    assert head.head.bus.plugged == ()
    if fault is Fault.BROWN_OUT:
        assert head.head.now_ns() - before_ns < 10_000_000


def test_a_transfer_may_find_no_memory() -> None:
    head, (host,) = ready(Shape.SIDE_BY_SIDE)
    host.put("TriggerSoftware", 1)
    head.cameras[0].faults.arm(Fault.NO_MEMORY)
    with pytest.raises(usb.core.USBError) as caught:
        host.block()
    assert caught.value.errno == errno.ENOMEM


def test_halting_the_stream_endpoint_drops_what_waits() -> None:
    _, (host,) = ready(Shape.SIDE_BY_SIDE)
    host.put("TriggerSoftware", 1)
    host.transfer(1024)
    host.device.ctrl_transfer(0x02, 0x03, 0, 0x83)
    host.device.clear_halt(0x83)
    with pytest.raises(usb.core.USBTimeoutError):
        host.transfer(1024)
    host.put("TriggerSoftware", 1)
    assert host.block().block_id == 1


def events(host: PlainHost) -> list[tuple[int, int]]:
    """Number and value of each event that has come."""
    found: list[tuple[int, int]] = []
    while True:
        try:
            packet = host.transfer(1024, EVENTS)
        except usb.core.USBTimeoutError:
            return found
        prefix, _, code, length, _ = struct.unpack_from("<IHHHH", packet)
        assert (prefix, code, length) == (0x45563355, 0x0C00, len(packet) - 12)
        _, number, _, value = struct.unpack("<HHQQ", packet[12:])
        found.append((number, value))


def test_events_come_where_they_are_wanted() -> None:
    head, (host,) = ready(Shape.SIDE_BY_SIDE)
    camera = head.cameras[0]
    eirm = host.number(host.number(0x1D8, 8) + 0x2C, 8)
    camera.press_shutter()
    assert events(host) == []
    host.write(eirm, 1)
    host.put("EventNotification", 1, 0)
    host.put("EventNotification", 1, 1)
    host.write(eirm + 8, 0x4FFF)
    camera.press_shutter()
    host.put("TriggerSoftware", 1)
    assert events(host) == [(0x4FFF, 0), (0x9002, 2), (0x9001, 0)]


def test_the_heads_own_button_can_be_the_trigger() -> None:
    head, (host,) = opened(Shape.SIDE_BY_SIDE)
    triggered(host, source=1)
    started(host)
    head.cameras[0].press_shutter()
    assert host.block().block_id == 0
