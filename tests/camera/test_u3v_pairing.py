"""Left and right halves find each other, or nobody."""

from __future__ import annotations

import random
from collections.abc import Iterable
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcam.camera.usb3vision.bootstrap import ClockSample
from fieldcam.camera.usb3vision.clocks import DeviceClock, fit_clock
from fieldcam.camera.usb3vision.pairing import (
    MAX_WAITING,
    AlternatePairing,
    ComponentPairing,
    Eye,
    EyeLayout,
    EyePair,
    Half,
    TwinPairing,
    raw_pair,
    split,
)
from fieldcam.errors import CameraUnsupported, PairMismatch
from fieldcam.values import ImageU8, PixelFormat

PERIOD_NS = 33_000_000
TOLERANCE_NS = PERIOD_NS // 2 - 1
HOST_EPOCH_NS = 5_000_000_000_000


def half(
    trigger: int,
    block_id: int,
    time_ns: int = 0,
    *,
    shape: tuple[int, ...] = (4, 8),
    pixel_format: PixelFormat = PixelFormat.BAYER_RG8,
) -> Half:
    """A half whose pixels tell its trigger, which nothing but the test may look at."""
    return Half(np.full(shape, trigger, np.uint8), pixel_format, block_id, time_ns)


def trigger_of(each: Half) -> int:
    return int(each.image.flat[0])


class Twin:
    """One of two triggered devices: a clock of its own, and blocks that count."""

    def __init__(self, offset_ns: int, drift: float, first_id: int) -> None:
        self.offset_ns, self.drift, self.next_id = offset_ns, drift, first_id

    def time_ns(self, host_ns: int) -> int:
        elapsed_ns = host_ns - HOST_EPOCH_NS
        return self.offset_ns + elapsed_ns + round(elapsed_ns * self.drift)

    def sample(self, host_ns: int, chance: random.Random) -> ClockSample:
        """Latched somewhere between asking and having asked."""
        before, after = chance.randrange(1, 2_000_000), chance.randrange(1, 2_000_000)
        middle_ns, spread_ns = host_ns + (after - before) // 2, (after + before) // 2
        return ClockSample(self.time_ns(host_ns), middle_ns, spread_ns)

    def fire(self, trigger: int, fate: str) -> Half | None:
        if fate == "missed":
            return None
        self.next_id += 1
        if fate == "lost":
            return None
        at_ns = HOST_EPOCH_NS + trigger * PERIOD_NS
        return half(trigger, self.next_id - 1, self.time_ns(at_ns))


twins = st.builds(
    Twin,
    st.integers(0, 2**62),
    st.floats(-1e-4, 1e-4),
    st.integers(0, 3),
)


def clock_of(twin: Twin, chance: random.Random) -> DeviceClock:
    seconds = range(0, 20, 2)
    return fit_clock([twin.sample(HOST_EPOCH_NS + s * 1_000_000_000, chance) for s in seconds])


def in_some_order(
    chance: random.Random, left: Iterable[Half | None], right: Iterable[Half | None]
) -> list[tuple[Eye, Half]]:
    """Each device's images in its own order, the devices anyhow, a few images apart."""
    queues = {Eye.LEFT: list(left), Eye.RIGHT: list(right)}
    arrived: list[tuple[Eye, Half]] = []
    while any(queues.values()):
        behind = max(queues, key=lambda eye: len(queues[eye]))
        apart = abs(len(queues[Eye.LEFT]) - len(queues[Eye.RIGHT]))
        eye = behind if apart >= MAX_WAITING - 1 else chance.choice([e for e in Eye if queues[e]])
        if (each := queues[eye].pop(0)) is not None:
            arrived.append((eye, each))
    return arrived


def paired(pairing: TwinPairing, arrived: Iterable[tuple[Eye, Half]]) -> list[int]:
    """The triggers of all pairs, whose halves agree."""
    pairs = [pair for eye, each in arrived if (pair := pairing.add(eye, each)) is not None]
    for pair in pairs:
        assert trigger_of(pair.left) == trigger_of(pair.right)
    return [trigger_of(pair.left) for pair in pairs]


fates = st.lists(st.sampled_from(["taken", "taken", "taken", "lost"]), min_size=1, max_size=20)


@given(twins, twins, fates, fates, st.randoms(use_true_random=False), st.booleans())
def test_every_trigger_that_both_devices_deliver_is_paired(
    left: Twin,
    right: Twin,
    left_fates: list[str],
    right_fates: list[str],
    chance: random.Random,
    clocked: bool,
) -> None:
    """Blocks lost on the way leave a gap in the ids; the first ones align the counts."""
    length = min(len(left_fates), len(right_fates))
    lefts = [left.fire(t, f) for t, f in enumerate(["taken", *left_fates[:length]])]
    rights = [right.fire(t, f) for t, f in enumerate(["taken", *right_fates[:length]])]
    pairing = TwinPairing(TOLERANCE_NS)
    if clocked:
        pairing.clocks = {Eye.LEFT: clock_of(left, chance), Eye.RIGHT: clock_of(right, chance)}
    both = [t for t in range(length + 1) if lefts[t] is not None and rights[t] is not None]
    assert paired(pairing, in_some_order(chance, lefts, rights)) == both


rough = st.lists(st.sampled_from(["taken", "taken", "lost", "missed"]), min_size=12, max_size=12)


@given(twins, twins, rough, rough, st.randoms(use_true_random=False))
def test_missed_triggers_never_mispair_and_pairing_recovers(
    left: Twin, right: Twin, left_fates: list[str], right_fates: list[str], chance: random.Random
) -> None:
    clean = ["taken"] * 3
    lefts = [left.fire(t, f) for t, f in enumerate([*left_fates, *clean])]
    rights = [right.fire(t, f) for t, f in enumerate([*right_fates, *clean])]
    pairing = TwinPairing(TOLERANCE_NS)
    pairing.clocks = {Eye.LEFT: clock_of(left, chance), Eye.RIGHT: clock_of(right, chance)}
    assert paired(pairing, in_some_order(chance, lefts, rights))[-1] == 14


def test_what_stays_alone_is_counted_and_let_go() -> None:
    pairing = TwinPairing(TOLERANCE_NS)
    for block_id in range(10):
        assert pairing.add(Eye.LEFT, half(block_id, block_id)) is None
    assert pairing.dropped == 10 - MAX_WAITING


def test_ids_that_begin_anew_align_anew() -> None:
    pairing = TwinPairing(TOLERANCE_NS)
    assert paired(pairing, [(Eye.LEFT, half(0, 5)), (Eye.RIGHT, half(0, 9))]) == [0]
    pairing.add(Eye.LEFT, half(1, 6))
    assert paired(pairing, [(Eye.RIGHT, half(2, 0)), (Eye.LEFT, half(2, 7))]) == [2]
    assert pairing.dropped == 1


@given(twins, st.randoms(use_true_random=False), st.integers(1, 30), st.integers(0, 600))
def test_a_fitted_clock_tells_host_time_to_a_few_milliseconds(
    twin: Twin, chance: random.Random, count: int, later_s: int
) -> None:
    samples = [twin.sample(HOST_EPOCH_NS + s * 1_000_000_000, chance) for s in range(count)]
    at_ns = HOST_EPOCH_NS + (count - 1) * 1_000_000_000
    clock = fit_clock(samples)
    assert abs(clock.to_host_ns(twin.time_ns(at_ns)) - at_ns) < 5_000_000
    later_ns = at_ns + later_s * 1_000_000_000
    error_ns = abs(clock.to_host_ns(twin.time_ns(later_ns)) - later_ns)
    assert error_ns < 5_000_000 + later_s * 3e-4 * 1e9


def test_a_drift_that_was_seen_is_kept() -> None:
    drift = 5e-5
    samples = [ClockSample(s * 10**9, round(s * 10**9 * (1 + drift)), 20_000) for s in range(21)]
    at_ns = fit_clock(samples).to_host_ns(600 * 10**9)
    assert abs(at_ns - 600 * 10**9 * (1 + drift)) < 1_000_000


def test_two_latches_in_a_second_tell_nothing_of_the_drift() -> None:
    samples = [ClockSample(0, 0, 1_000_000), ClockSample(10**9, 10**9 + 900_000, 1_000_000)]
    assert abs(fit_clock(samples).to_host_ns(600 * 10**9) - 600 * 10**9) < 1_000_000


def test_a_long_latch_weighs_little() -> None:
    sure = [ClockSample(10**9 * s, 7 + 10**9 * s, 50_000) for s in range(5)]
    slow = ClockSample(5 * 10**9, 7 + 5 * 10**9 + 40_000_000, 40_000_000)
    at_ns = fit_clock([*sure, slow]).to_host_ns(5 * 10**9)
    assert abs(at_ns - 5 * 10**9 - 7) < 100_000


def test_components_pair_by_their_exposure_only() -> None:
    pairing = ComponentPairing()
    arrived = [(0, Eye.LEFT), (0, Eye.RIGHT), (1, Eye.RIGHT), (2, Eye.RIGHT), (2, Eye.LEFT)]
    pairs = [pairing.add(exposure, eye, half(exposure, exposure)) for exposure, eye in arrived]
    assert [pair is not None for pair in pairs] == [False, True, False, False, True]
    assert pairing.dropped == 1
    same_eye = ComponentPairing()
    assert [same_eye.add(0, Eye.LEFT, half(0, 0)) for _ in range(2)] == [None, None]
    assert same_eye.dropped == 1


@given(st.lists(st.booleans(), max_size=30), st.sampled_from([0, 1]))
def test_alternate_blocks_pair_with_their_neighbour_only(
    arrives: list[bool], first_id: int
) -> None:
    pairing = AlternatePairing(first_id)
    ids = [first_id + place for place, came in enumerate(arrives) if came]
    pairs = [pair for n in ids if (pair := pairing.add(half(0, n))) is not None]
    expected = [
        (n, n + 1) for n in range(first_id, first_id + len(arrives), 2) if {n, n + 1} <= {*ids}
    ]
    assert [(pair.left.block_id, pair.right.block_id) for pair in pairs] == expected


@pytest.mark.parametrize(
    ("layout", "shape"), [(EyeLayout.SIDE_BY_SIDE, (6, 8)), (EyeLayout.STACKED, (8, 6))]
)
def test_one_image_of_both_eyes_is_split_without_a_copy(
    layout: EyeLayout, shape: tuple[int, int]
) -> None:
    image: ImageU8 = np.arange(48, dtype=np.uint8).reshape(shape)
    both = split(Half(image, PixelFormat.BAYER_RG8, 3, 99), layout)
    joined = np.concatenate((both.left.image, both.right.image), axis=layout.value)
    np.testing.assert_array_equal(joined, image)
    assert both.left.image.shape == both.right.image.shape
    assert np.shares_memory(both.right.image, image)
    assert (both.right.block_id, both.right.device_time_ns) == (3, 99)


@pytest.mark.parametrize(
    ("width", "pixel_format", "fits"),
    [
        (8, PixelFormat.BAYER_RG8, True),
        (6, PixelFormat.BAYER_RG8, False),
        (6, PixelFormat.MONO8, True),
        (7, PixelFormat.MONO8, False),
    ],
)
def test_an_image_is_split_only_where_both_halves_begin_alike(
    width: int, pixel_format: PixelFormat, fits: bool
) -> None:
    each = half(0, 0, shape=(4, width), pixel_format=pixel_format)
    if fits:
        assert split(each, EyeLayout.SIDE_BY_SIDE).left.image.shape == (4, width // 2)
    else:
        with pytest.raises(CameraUnsupported, match=f"{width} pixels long"):
            split(each, EyeLayout.SIDE_BY_SIDE)


def test_a_pair_becomes_what_the_store_takes() -> None:
    now = datetime.now(UTC)
    pair = EyePair(half(1, 1, 11), half(2, 2, 22))
    raw = raw_pair(pair, now, ("A", "B"), 4)
    assert raw.left is pair.left.image
    assert (raw.left_timestamp_ns, raw.right_timestamp_ns) == (11, 22)
    assert (raw.left_serial, raw.right_serial, raw.trigger_ordinal) == ("A", "B", 4)
    assert raw.pixel_format is PixelFormat.BAYER_RG8


@pytest.mark.parametrize(
    "other", [half(0, 0, shape=(4, 9)), half(0, 0, pixel_format=PixelFormat.MONO8)]
)
def test_unlike_halves_are_no_pair(other: Half) -> None:
    with pytest.raises(PairMismatch):
        raw_pair(EyePair(half(0, 0), other), datetime.now(UTC), ("A", "B"), 0)
