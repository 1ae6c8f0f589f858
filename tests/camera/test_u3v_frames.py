"""Frames out of transfers: whole ones only, and going on after anything."""

from __future__ import annotations

import gc
import struct
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scripted_usb import ScriptedStream, cut, leader, trailer

from fieldcam.camera.usb3vision.assembly import FrameAssembler, SpoiledFrame
from fieldcam.camera.usb3vision.blocks import (
    ImageInfo,
    Leader,
    Trailer,
    parse_leader,
    parse_trailer,
    trailer_at_end,
)
from fieldcam.camera.usb3vision.bootstrap import Sirm
from fieldcam.camera.usb3vision.frames import FramePool, UsbFrame
from fieldcam.camera.usb3vision.transfer_plan import plan_transfers
from fieldcam.camera.usb3vision.transport import (
    EndpointStalled,
    LinkFault,
    TransferFault,
    TransferOverflow,
)
from fieldcam.errors import (
    CameraUnsupported,
)

WIDTH, HEIGHT = 100, 130
PAYLOAD = np.random.default_rng(4).integers(0, 255, WIDTH * HEIGHT, np.uint8).tobytes()
TRANSFER = 4096
SIRM = Sirm(0x62000, 1024, len(PAYLOAD), 52, 32)
PLAN = plan_transfers(SIRM, TRANSFER)


def block(block_id: int, payload: bytes = PAYLOAD) -> list[bytes]:
    head, tail = leader(block_id, WIDTH, HEIGHT), trailer(block_id, len(payload), HEIGHT)
    return [head, *cut(payload, TRANSFER), tail]


def assembled(
    transfers: Sequence[bytes | TransferFault], assembler: FrameAssembler | None = None
) -> list[UsbFrame | SpoiledFrame]:
    """All that comes out of a stream of these transfers."""
    assembler = assembler or FrameAssembler(PLAN, FramePool(PLAN.capacity, 2))
    pipe = ScriptedStream(transfers)
    outcomes: list[UsbFrame | SpoiledFrame | None] = []
    while pipe.packets:
        window = assembler.window()
        assert len(window)
        try:
            outcomes.append(assembler.received(pipe.read(window, 1.0), now_ns=5))
        except TransferFault:
            outcomes.append(assembler.abandon("failed"))
    return [outcome for outcome in outcomes if outcome is not None]


def told(outcomes: list[UsbFrame | SpoiledFrame]) -> list[tuple[int, bool]]:
    """Block id and whether it came whole, bytes compared."""
    for outcome in outcomes:
        if isinstance(outcome, UsbFrame):
            assert outcome.payload.tobytes() == PAYLOAD
    return [(outcome.block_id, isinstance(outcome, UsbFrame)) for outcome in outcomes]


def test_leaders_and_trailers_are_parsed() -> None:
    packed = leader(7, 640, 480, timestamp_ns=99, padding_x=4)
    assert parse_leader(packed) == Leader(7, 1, 99, ImageInfo(0x01080009, 640, 480, 0, 0, 4))
    assert parse_trailer(trailer(7, 1000, 480, 0xA100)) == Trailer(7, 0xA100, 1000, 480)
    plain = struct.pack("<IHHQHHQ", 0x54563355, 0, 28, 7, 0, 0, 1000)
    assert parse_trailer(plain) == Trailer(7, 0, 1000, None)
    assert trailer_at_end(b"data" + plain) == (Trailer(7, 0, 1000, None), 4)
    chunks_only = struct.pack("<IHHQHHQ", 0x4C563355, 0, 28, 7, 0, 0x4000, 99)
    assert parse_leader(chunks_only) == Leader(7, 0x4000, 99, None)


@given(st.binary(max_size=80))
def test_fuzz_any_transfer_is_a_leader_a_trailer_or_neither(transfer: bytes) -> None:
    for head in (b"", b"U3VL", b"U3VT", leader(1, 2, 3)[:20], trailer(1, 2, 3)[:20]):
        parse_leader(head + transfer)
        parse_trailer(head + transfer)
        trailer_at_end(transfer + head)


@pytest.mark.parametrize(
    ("pixel_format", "padding", "size"),
    [
        (0x01080009, 0, 13_000),
        (0x01080009, 28, 128 * 130),
        (0x02180014, 0, 39_000),
        (0x010C0059, 0, 19_500),
        (0x010A0058, 0, 16_250),
        (0x0110002F, 0, 26_000),
    ],
)
def test_an_images_size_follows_from_its_leader(pixel_format: int, padding: int, size: int) -> None:
    assert ImageInfo(pixel_format, WIDTH, HEIGHT, 0, 0, padding).size_bytes == size


def test_the_plan_of_the_measured_camera() -> None:
    plan = plan_transfers(Sirm(0, 1024, 3_110_400, 52, 32))
    assert (plan.payload, plan.payload_count, plan.final) == (1 << 20, 2, 1_013_760)
    assert (plan.leader, plan.trailer) == (1024, 1024)


@given(st.integers(1, 50_000_000), st.integers(0, 16), st.integers(1, 1 << 21))
def test_every_plan_is_aligned_and_large_enough(size: int, log2: int, largest: int) -> None:
    sirm = Sirm(0, 1 << log2, size, 52, 32)
    plan = plan_transfers(sirm, largest)
    for length in (plan.leader, plan.trailer, plan.payload, plan.final):
        assert length % sirm.alignment_bytes == 0
    told_camera = plan.payload * plan.payload_count + plan.final
    assert size <= told_camera < size + sirm.alignment_bytes
    assert told_camera <= plan.capacity
    assert all(window % 1024 == 0 for window in plan.windows)
    assert plan.windows


@pytest.mark.parametrize(
    "sirm",
    [Sirm(0, 1, 0, 52, 32), Sirm(0, 1, 1 << 40, 52, 32), Sirm(0, 1, 100, 1 << 20, 32)],
)
def test_an_impossible_stream_is_refused(sirm: Sirm) -> None:
    with pytest.raises(CameraUnsupported):
        plan_transfers(sirm)


@pytest.mark.parametrize("length", [1, 1023, 1024, 4096, 4097, 5 * 1024, 13_000])
@pytest.mark.parametrize("ending", ["short", "padded", "empty packet", "nothing"])
def test_frames_of_any_length_come_whole(length: int, ending: str) -> None:
    """However the camera ends data that fill their last packet."""
    payload = PAYLOAD[:length]
    plan = plan_transfers(Sirm(0, 2048, length, 52, 32), TRANSFER)
    data = cut(payload, TRANSFER)
    if ending == "padded":
        data = cut(payload.ljust(plan.payload * plan.payload_count + plan.final, b"\0"), TRANSFER)
    if ending == "empty packet" and length % 1024 == 0:
        data.append(b"")
    sent = [leader(3, length, 1), *data, trailer(3, length, 1)]
    assembler = FrameAssembler(plan, FramePool(plan.capacity, 1))
    outcomes = assembled([*sent, *sent], assembler)
    assert [type(outcome) for outcome in outcomes] == [UsbFrame, UsbFrame]
    assert all(isinstance(o, UsbFrame) and o.payload.tobytes() == payload for o in outcomes)


def test_a_trailer_behind_whole_packets_does_not_count_as_data() -> None:
    plan = plan_transfers(Sirm(0, 1024, 2058, 52, 32), TRANSFER)
    sent = [leader(3, 2058, 1), bytes(2048), trailer(3, 2058, 1)]
    (outcome,) = assembled(sent, FrameAssembler(plan, FramePool(plan.capacity, 1)))
    assert outcome == SpoiledFrame(3, "came with 2048 of 2058 bytes")


def without(transfers: list[bytes], index: int) -> list[bytes]:
    return transfers[:index] + transfers[index + 1 :]


def replaced(transfers: list[bytes], index: int, transfer: bytes) -> list[bytes]:
    return [*transfers[:index], transfer, *transfers[index + 1 :]]


DAMAGE: dict[str, Callable[[list[bytes]], Sequence[bytes | TransferFault]]] = {
    "no leader": lambda sent: without(sent, 0),
    "no first data": lambda sent: without(sent, 1),
    "no last data": lambda sent: without(sent, -2),
    "no data": lambda sent: [sent[0], sent[-1]],
    "no trailer": lambda sent: sent[:-1],
    "leader only": lambda sent: sent[:1],
    "short first data": lambda sent: replaced(sent, 1, sent[1][:-700]),
    "short last data": lambda sent: replaced(sent, -2, sent[-2][:-7]),
    "data twice": lambda sent: [*sent[:2], *sent[1:]],
    "given up": lambda sent: [*sent[:-1], trailer(1, len(PAYLOAD), HEIGHT, 0xA100)],
    "few valid": lambda sent: [*sent[:-1], trailer(1, len(PAYLOAD) - 1, HEIGHT)],
    "many valid": lambda sent: [*sent[:-1], trailer(1, 1 << 40, HEIGHT)],
    "few rows": lambda sent: [*sent[:-1], trailer(1, len(PAYLOAD), HEIGHT - 1)],
    "other trailer": lambda sent: [*sent[:-1], trailer(9, len(PAYLOAD), HEIGHT)],
    "stalled": lambda sent: [*sent[:2], EndpointStalled("stalled"), *sent[3:]],
    "broken link": lambda sent: [*sent[:2], LinkFault("link")],
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_frame_is_never_handed_on_and_the_next_one_is(
    damage: Callable[[list[bytes]], Sequence[bytes | TransferFault]],
) -> None:
    outcomes = told(assembled([*block(0), *damage(block(1)), *block(2), *block(3)]))
    assert outcomes[0] == (0, True)
    assert (1, True) not in outcomes
    assert outcomes[-2:] == [(2, True), (3, True)]


def test_finding_the_next_leader_takes_few_reads() -> None:
    """A read costs a round trip to the kernel, whether of a kilobyte or of a megabyte."""
    size = 3_110_400
    plan = plan_transfers(Sirm(0, 1024, size, 52, 32))
    assembler = FrameAssembler(plan, FramePool(plan.capacity, 1))
    data = [*cut(bytes(size), plan.payload), trailer(1, size, 1080)]
    pipe = ScriptedStream([*data, leader(2, 2880, 1080), *data[:-1], trailer(2, size, 1080)])
    outcomes = []
    while pipe.packets:
        outcomes.append(assembler.received(pipe.read(assembler.window(), 1.0), 0))
    assert isinstance(outcomes[-1], UsbFrame)
    assert len(outcomes) < 12


def test_a_leader_inside_the_data_is_data() -> None:
    payload = bytearray(PAYLOAD)
    payload[TRANSFER : TRANSFER + 52] = leader(8, 2, 2)
    payload[-40:-8] = trailer(2, 6, 2)
    (outcome,) = assembled(list(block(1, bytes(payload))))
    assert isinstance(outcome, UsbFrame)
    assert outcome.payload.tobytes() == bytes(payload)


def test_lost_blocks_are_counted_by_their_ids() -> None:
    assembler = FrameAssembler(PLAN, FramePool(PLAN.capacity, 2))
    sent = [*block(1), *block(2), *block(5), *block(0), *block(1)]
    outcomes = assembled(list(sent), assembler)
    assert [o.lost_before for o in outcomes if isinstance(o, UsbFrame)] == [0, 0, 2, 0, 0]
    assert assembler.counts.lost == 2
    assert assembler.counts.frames == 5


pieces = st.one_of(
    st.integers(0, 5).map(lambda n: leader(n, WIDTH, HEIGHT)),
    st.integers(0, 5).map(lambda n: trailer(n, len(PAYLOAD), HEIGHT)),
    st.sampled_from(cut(PAYLOAD, TRANSFER)),
    st.binary(max_size=1500),
    st.sampled_from([EndpointStalled("stalled"), TransferOverflow("overflow")]),
    st.just(b"U3VL"),
    st.just(b"U3VT"),
)


@given(st.lists(pieces, max_size=25))
def test_fuzz_after_any_transfers_the_second_next_frame_comes_whole(
    noise: list[bytes | TransferFault],
) -> None:
    outcomes = assembled([*noise, *block(100), *block(101)])
    last = outcomes[-1]
    assert isinstance(last, UsbFrame)
    assert (last.block_id, last.payload.tobytes()) == (101, PAYLOAD)
    for outcome in outcomes:
        if isinstance(outcome, UsbFrame):
            assert len(outcome.payload) == len(PAYLOAD)


def test_memory_is_used_again_only_when_nothing_refers_to_it() -> None:
    pool = FramePool(4096, 1)
    first = pool.take()
    address = first.ctypes.data
    view = first[100:200].reshape(10, 10)[:, ::2]
    del first
    gc.collect()
    other = pool.take()
    assert other.ctypes.data != address
    del view
    gc.collect()
    assert pool.take().ctypes.data == address
