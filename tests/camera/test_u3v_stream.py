"""The armed stream: setting it up, reading frames, going on after faults, stopping."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Sequence
from contextlib import suppress
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scripted_usb import ScriptedControl, ScriptedStream, leader, trailer

from fieldcam.camera.usb3vision import stream
from fieldcam.camera.usb3vision.bootstrap import Eirm, Sbrm
from fieldcam.camera.usb3vision.channel import ControlChannel
from fieldcam.camera.usb3vision.events import CameraEvent, EventChannel, parse_event
from fieldcam.camera.usb3vision.gencp import MalformedPacket
from fieldcam.camera.usb3vision.stream import MAX_FAULTS, ImageStream
from fieldcam.camera.usb3vision.transport import (
    EndpointStalled,
    LinkFault,
    LinkSpeed,
    TransferFault,
    TransferOverflow,
)
from fieldcam.errors import (
    CameraUnplugged,
    CameraUnsupported,
    CaptureTimeout,
    DeviceError,
    FrameIncomplete,
)

WIDTH, HEIGHT = 100, 130
PAYLOAD = np.random.default_rng(4).integers(0, 255, WIDTH * HEIGHT, np.uint8).tobytes()
SIRM_ADDRESS = 0x62000
SBRM = Sbrm((1, 0), 1024, 1024, 1, SIRM_ADDRESS, None, LinkSpeed.SUPER)


def whole(block_id: int) -> list[bytes]:
    """A block as the plan of `Setup` cuts it."""
    return [leader(block_id, WIDTH, HEIGHT), PAYLOAD, trailer(block_id, len(PAYLOAD), HEIGHT)]


class Setup:
    """A stream over a scripted camera."""

    def __init__(self, *transfers: bytes | TransferFault) -> None:
        self.control = ScriptedControl()
        self.control.put(SIRM_ADDRESS, struct.pack("<IIQII24x", 10 << 24, 1, len(PAYLOAD), 52, 32))
        self.pipe = ScriptedStream([*whole(77), b"old"])
        self.stream = ImageStream(self.pipe, ControlChannel(self.control, self.control), SBRM)
        self.stream.arm()
        self.pipe.send(*transfers)

    def written(self) -> list[int]:
        """Offsets of the registers written, in order."""
        return [
            address - SIRM_ADDRESS
            for command, _, address, _ in self.control.requests
            if command == 0x0802
        ]

    def enabled(self) -> int:
        return self.control.memory[SIRM_ADDRESS + 4]


def test_arming_stops_sets_up_resets_and_starts() -> None:
    setup = Setup()
    assert setup.written() == [0x04, 0x18, 0x1C, 0x20, 0x24, 0x28, 0x2C, 0x04]
    assert setup.pipe.acts == ["halt", "clear"]
    assert setup.enabled() == 1
    places = range(SIRM_ADDRESS + 0x18, SIRM_ADDRESS + 0x30)
    values = struct.unpack("<6I", bytes(setup.control.memory[place] for place in places))
    assert values == (1024, 1 << 20, 0, 13_312, 0, 1024)


def test_a_picture_of_a_crashed_session_is_not_taken_for_a_new_one() -> None:
    setup = Setup(leader(0, WIDTH, HEIGHT), PAYLOAD, trailer(0, len(PAYLOAD), HEIGHT))
    assert setup.stream.receive(1.0).block_id == 0


def test_nothing_within_the_deadline_is_a_timeout() -> None:
    with pytest.raises(CaptureTimeout, match=r"within 0\.01 s"):
        Setup().stream.receive(0.01)


def test_a_frame_that_began_in_time_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    setup = Setup(*whole(0))
    ticks = itertools.count(0.0, 0.4)
    clock = SimpleNamespace(monotonic=lambda: next(ticks), monotonic_ns=lambda: 0)
    monkeypatch.setattr(stream, "time", clock)
    assert setup.stream.receive(0.5).block_id == 0


@pytest.mark.parametrize(
    "transfers",
    [whole(0)[:1], whole(0)[:2], [whole(0)[0], LinkFault("x")], [whole(0)[0], whole(0)[2]]],
    ids=["leader", "no trailer", "link", "no data"],
)
def test_a_spoiled_frame_is_told_at_once_and_the_next_one_follows(
    transfers: Sequence[bytes | TransferFault],
) -> None:
    setup = Setup(*transfers)
    with pytest.raises(FrameIncomplete, match="The picture"):
        setup.stream.receive(1.0)
    setup.pipe.send(*whole(1))
    assert setup.stream.receive(1.0).block_id == 1
    assert setup.stream.counts.spoiled == 1


def test_one_stall_is_cleared_and_a_second_one_arms_the_stream_anew() -> None:
    setup = Setup(EndpointStalled("first"), *whole(0))
    setup.pipe.acts.clear()
    setup.control.requests.clear()
    assert setup.stream.receive(1.0).block_id == 0
    assert (setup.pipe.acts, setup.written()) == (["clear"], [])
    setup.pipe.send(EndpointStalled("first"), EndpointStalled("second"))
    with pytest.raises(CaptureTimeout):
        setup.stream.receive(0.01)
    assert setup.written()[-1] == 0x04
    assert setup.pipe.acts == ["clear", "clear", "halt", "clear"]
    assert setup.enabled() == 1
    assert setup.stream.counts.frames == 1


def test_repeated_overflow_makes_the_transfers_smaller() -> None:
    setup = Setup()
    setup.pipe.send(TransferOverflow("first"), TransferOverflow("second"))
    with pytest.raises(CaptureTimeout):
        setup.stream.receive(0.01)
    place = SIRM_ADDRESS + 0x1C
    assert bytes(setup.control.memory[place + i] for i in range(4)) == struct.pack("<I", 1 << 19)


def test_a_bus_error_of_an_unplugged_camera_is_told_as_unplugged() -> None:
    setup = Setup(leader(0, WIDTH, HEIGHT), LinkFault("first sign"))
    setup.control.gone = CameraUnplugged("gone")
    with pytest.raises(CameraUnplugged):
        setup.stream.receive(1.0)


def test_endless_faults_end() -> None:
    setup = Setup(*[LinkFault("bad cable")] * (MAX_FAULTS + 1))
    with pytest.raises(LinkFault, match="bad cable"):
        setup.stream.receive(1.0)


def test_late_frames_are_thrown_away_before_a_trigger() -> None:
    setup = Setup(*whole(0), whole(1)[0], *whole(2))
    assert setup.stream.flush() == 3
    setup.pipe.send(*whole(3))
    frame = setup.stream.receive(1.0)
    assert (frame.block_id, frame.lost_before) == (3, 0)
    assert setup.stream.flush() == 0


def test_disarming_throws_the_rest_away_and_stops() -> None:
    setup = Setup(*whole(0), *whole(1))
    setup.stream.receive(1.0)
    setup.stream.disarm()
    assert not setup.pipe.packets
    assert setup.enabled() == 0
    with pytest.raises(DeviceError, match="off"):
        setup.stream.receive(1.0)


def test_a_camera_without_a_stream_is_refused() -> None:
    control = ScriptedControl()
    none = Sbrm((1, 0), 1024, 1024, 0, None, None, LinkSpeed.SUPER)
    with pytest.raises(CameraUnsupported):
        ImageStream(ScriptedStream(), ControlChannel(control, control), none)


def event(number: int, timestamp_ns: int, data: bytes) -> bytes:
    payload = struct.pack("<HHQ", 0, number, timestamp_ns) + data
    return struct.pack("<IHHHH", 0x45563355, 0, 0x0C00, len(payload), 0) + payload


@given(st.integers(0, 0xFFFF), st.integers(0, 2**64 - 1), st.binary(max_size=40))
def test_events_are_parsed(number: int, timestamp_ns: int, data: bytes) -> None:
    packet = event(number, timestamp_ns, data)
    assert parse_event(packet + b"behind") == CameraEvent(number, timestamp_ns, data)


@given(st.binary(max_size=60))
def test_fuzz_any_bytes_are_an_event_or_malformed(packet: bytes) -> None:
    for candidate in (packet, event(1, 2, b"")[:9] + packet):
        with suppress(MalformedPacket):
            assert len(parse_event(candidate).data) <= len(candidate)


def test_events_are_received_one_by_one() -> None:
    control = ScriptedControl()
    control.put(0x63000, bytes(12))
    pipe = ScriptedStream([event(0x9001, 5, b"line"), b"noise", event(1, 6, b"")])
    channel = EventChannel(pipe, ControlChannel(control, control), Eirm(0x63000, 1024))
    channel.enable()
    assert control.memory[0x63000] == 1
    received = [channel.receive(0.1) for _ in range(4)]
    assert received == [CameraEvent(0x9001, 5, b"line"), None, CameraEvent(1, 6, b""), None]
