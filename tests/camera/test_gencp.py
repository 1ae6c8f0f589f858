"""The camera's memory over GenCP, whatever becomes of single packets."""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scripted_usb import Mishap, ScriptedControl

from fieldcam.camera.usb3vision.channel import ATTEMPTS, ChannelLimits, ControlChannel
from fieldcam.camera.usb3vision.gencp import (
    Ack,
    GencpCommand,
    GencpStatus,
    MalformedPacket,
    describe,
    pack_read,
    pack_write,
    parse_ack,
)
from fieldcam.errors import CameraRefused, CameraSilent, CameraUnplugged

DATA = bytes(range(256)) * 4
BASE = 0x1_0000_0000


def opened(camera: ScriptedControl, limits: ChannelLimits | None = None) -> ControlChannel:
    camera.put(BASE, DATA * 2)
    channel = ControlChannel(camera, camera)
    if limits is not None:
        channel.limits = limits
    return channel


def test_commands_are_packed_as_the_standard_lays_them_out() -> None:
    read = bytes.fromhex("55335643 0040 0008 0c00 3412 8877665544332211 0000 4000".replace(" ", ""))
    assert pack_read(0x1234, 0x1122334455667788, 64) == read
    write = bytes.fromhex("55335643 0040 0208 0a00 0100 0400000000000000 aabb".replace(" ", ""))
    assert pack_write(1, 4, b"\xaa\xbb") == write


def test_acknowledgements_are_parsed() -> None:
    ack = parse_ack(struct.pack("<IHHHH", 0x43563355, 0, 0x0801, 4, 7) + b"abcd" + b"beyond")
    assert ack == Ack(0, GencpCommand.READ_ACK, 7, b"abcd")
    pending = parse_ack(struct.pack("<IHHHHHH", 0x43563355, 0, 0x0805, 4, 7, 0, 1500))
    assert pending.is_pending
    assert pending.pending_s == 1.5


@given(st.binary(max_size=60))
def test_fuzz_any_bytes_are_an_acknowledgement_or_malformed(packet: bytes) -> None:
    for candidate in (packet, struct.pack("<I", 0x43563355) + packet):
        try:
            ack = parse_ack(candidate)
        except MalformedPacket:
            continue
        assert ack.pending_s >= 0 if ack.is_pending else ack.payload in candidate


@given(st.integers(0, 900), st.integers(0, 124), st.integers(16, 200), st.integers(24, 200))
def test_memory_is_read_and_written_whole_in_chunks_of_any_size(
    offset: int, length: int, ack_bytes: int, command_bytes: int
) -> None:
    camera = ScriptedControl()
    channel = opened(camera, ChannelLimits(command_bytes, ack_bytes))
    assert channel.read(BASE + offset, length) == DATA[offset : offset + length]
    assert camera.longest_ack <= ack_bytes
    channel.write(BASE + offset, b"\x5a" * length)
    expected = DATA[:offset] + b"\x5a" * length + DATA[offset + length :]
    assert channel.read(BASE, len(DATA)) == expected[: len(DATA)]
    longest = max((size for command, _, _, size in camera.requests if command == 0x0802), default=0)
    assert longest + 20 <= command_bytes


@pytest.mark.parametrize("ack_bytes", [512, 1024, 1536])
def test_an_answer_of_whole_packets_is_not_waited_for_in_vain(ack_bytes: int) -> None:
    channel = opened(ScriptedControl(), ChannelLimits(1024, 2048))
    assert channel.read(BASE, ack_bytes - 12) == (DATA * 2)[: ack_bytes - 12]


def test_request_ids_differ_and_are_never_zero() -> None:
    camera = ScriptedControl()
    channel = opened(camera)
    for _ in range(70_000):
        channel._next_id()  # the wrap is 65,535 requests away
    for _ in range(3):
        channel.read(BASE, 4)
    ids = [request_id for _, request_id, _, _ in camera.requests]
    assert len(set(ids)) == 3
    assert 0 not in {channel._next_id() for _ in range(65_536)}


@pytest.mark.parametrize("mishap", list(Mishap))
@pytest.mark.parametrize("times", [1, ATTEMPTS - 1])
def test_a_mishap_costs_attempts_but_no_answer(mishap: Mishap, times: int) -> None:
    camera = ScriptedControl(mishaps=[mishap] * times)
    channel = opened(camera)
    assert channel.read(BASE, 16) == DATA[:16]
    assert channel.read(BASE + 100, 16) == DATA[100:116]
    assert not camera.halted


@example([Mishap.LATE] * ATTEMPTS)
@given(st.lists(st.sampled_from([None, Mishap.LATE, Mishap.LOST, Mishap.CUT_OFF]), max_size=12))
def test_a_stale_answer_is_never_taken_for_another(mishaps: list[Mishap | None]) -> None:
    channel = opened(ScriptedControl(mishaps=mishaps))
    for offset in range(0, 40, 4):
        try:
            assert channel.read(BASE + offset, 4) == DATA[offset : offset + 4]
        except CameraSilent:
            assert mishaps.count(None) < len(mishaps)


def test_a_stall_is_cleared_on_both_endpoints() -> None:
    camera = ScriptedControl(mishaps=[Mishap.STALLED, None, Mishap.LOST])
    channel = opened(camera)
    channel.read(BASE, 4)
    channel.read(BASE, 4)
    assert camera.clears == 2


@pytest.mark.parametrize(
    "mishap", [Mishap.LOST, Mishap.CUT_OFF, Mishap.STALLED, Mishap.BABBLE, Mishap.BROKEN_LINK]
)
def test_a_camera_that_never_answers_is_silent(mishap: Mishap) -> None:
    camera = ScriptedControl(mishaps=[mishap] * 20)
    with pytest.raises(CameraSilent) as caught:
        opened(camera).read(BASE, 4)
    assert caught.value.__cause__ is not None
    assert len(camera.requests) == ATTEMPTS


def test_a_camera_that_fell_silent_is_tried_once_until_it_answers() -> None:
    lost = Mishap.LOST
    camera = ScriptedControl(mishaps=[*[lost] * (ATTEMPTS + 1), None, lost, lost])
    channel = opened(camera)
    asked = []
    for _ in range(2):
        with pytest.raises(CameraSilent):
            channel.read(BASE, 4)
        asked.append(len(camera.requests))
    assert asked == [ATTEMPTS, ATTEMPTS + 1]
    for offset in (0, 4):
        assert channel.read(BASE + offset, 4) == DATA[offset : offset + 4]


def test_a_camera_that_stays_busy_is_named_busy() -> None:
    camera = ScriptedControl(mishaps=[Mishap.BUSY] * 20)
    with pytest.raises(CameraRefused, match="busy"):
        opened(camera).read(BASE, 4)


@pytest.mark.parametrize("mishap", [Mishap.LOST, Mishap.CUT_OFF, Mishap.STALLED])
def test_what_makes_the_camera_act_is_sent_once(mishap: Mishap) -> None:
    camera = ScriptedControl(mishaps=[mishap])
    channel = opened(camera)
    with channel.acting(), pytest.raises(CameraSilent, match="none of 1 attempt"):
        channel.write(BASE, b"\x01\0\0\0")
    assert len(camera.requests) == 1
    assert channel.read(BASE, 4) == b"\x01\0\0\0"


def test_what_a_busy_camera_refused_is_sent_again_and_reads_always_are() -> None:
    camera = ScriptedControl(mishaps=[Mishap.BUSY, None, Mishap.LOST])
    channel = opened(camera)
    with channel.acting():
        channel.write(BASE, b"\x01\0\0\0")
        assert channel.read(BASE, 4) == b"\x01\0\0\0"
    assert len(camera.requests) == 4


def test_an_unplugged_camera_is_reported_at_once() -> None:
    camera = ScriptedControl(gone=CameraUnplugged("gone"))
    with pytest.raises(CameraUnplugged):
        opened(camera).read(BASE, 4)
    assert not camera.requests


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda channel: channel.read(0x10, 4), r"to give 4 bytes at 0x10: invalid address"),
        (lambda channel: channel.write(0x20, b"abc"), r"to write 3 bytes at 0x20: invalid address"),
    ],
)
def test_a_refusal_says_what_was_refused(
    act: Callable[[ControlChannel], object], words: str
) -> None:
    with pytest.raises(CameraRefused, match=words):
        act(opened(ScriptedControl()))


@pytest.mark.parametrize(("address", "length"), [(-4, 4), (2**64 - 2, 4), (2**70, 4), (0, -1)])
def test_addresses_that_no_camera_has_are_refused_unasked(address: int, length: int) -> None:
    camera = ScriptedControl()
    with pytest.raises(CameraRefused, match="No camera has"):
        opened(camera).read(address, length)
    with pytest.raises(CameraRefused, match="No camera has"):
        opened(camera).write(address if length > 0 else -1, bytes(4))
    assert not camera.requests


def only_words(address: int, length: int) -> int:
    return GencpStatus.BAD_ALIGNMENT if address % 4 or length % 4 else 0


@given(st.integers(0, 800), st.integers(0, 200))
def test_odd_reads_work_on_a_camera_of_whole_words(offset: int, length: int) -> None:
    channel = opened(ScriptedControl(refusal=only_words))
    assert channel.read(BASE + offset, length) == DATA[offset : offset + length]


def test_a_camera_that_refuses_even_whole_words_is_believed() -> None:
    channel = opened(ScriptedControl(refusal=lambda address, length: GencpStatus.BAD_ALIGNMENT))
    with pytest.raises(CameraRefused, match="bad alignment"):
        channel.read(BASE, 4)


def test_a_status_of_the_makers_own_is_shown_as_a_number() -> None:
    assert describe(0x8006) == "access denied (0x8006)"
    assert describe(0xC123) == "a status of its own (0xC123)"
