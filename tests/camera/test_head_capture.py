"""The head over the emulated cameras: pairs, previews, and what each fault comes to."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from emulated_camera.camera import Camera
from emulated_camera.descriptors import Identity, Speed
from emulated_camera.faults import ALWAYS, Fault
from emulated_camera.features import LINES, STROBE_LINE
from emulated_camera.shapes import LEFT_SERIAL, RIGHT_SERIAL, Shape
from emulated_head import DEADLINE_S, DISPARITY, HEIGHT, QUICK, SMALL, WIDTH, Bench

from fieldcam.camera.genapi import CommandFeature, NodeMap, Registers
from fieldcam.camera.head import eyes
from fieldcam.camera.head.logs import camera_log
from fieldcam.camera.usb3vision import bootstrap
from fieldcam.camera.usb3vision.bootstrap import ClockSample
from fieldcam.camera.usb3vision.channel import ATTEMPTS, ControlChannel
from fieldcam.camera.usb3vision.gencp import Ack
from fieldcam.camera.usb3vision.transport import TransferFault
from fieldcam.errors import (
    CameraBusy,
    CameraForbidden,
    CameraPowerLost,
    CameraRefused,
    CameraSettingsInvalid,
    CameraSilent,
    CameraUnplugged,
    CameraUnsupported,
    CaptureTimeout,
    DeviceError,
    FlashMissing,
    FrameIncomplete,
    UsbMemoryShort,
)
from fieldcam.values import PixelFormat, RawPair

BRIEF_S = 0.15


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp() / "cache"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.getbasetemp() / "no-config"))


def assert_pair(pair: RawPair) -> None:
    """Both eyes of one exposure, lit, left before right."""
    assert pair.left.shape == pair.right.shape == (HEIGHT, WIDTH)
    # A fault may write what looks like a leader into the first row.
    assert np.array_equal(pair.left[1:, DISPARITY:], pair.right[1:, :-DISPARITY])
    assert pair.left.mean() > 50


@pytest.mark.parametrize("shape", Shape)
def test_each_way_to_carry_a_pair_gives_pairs_and_previews(tmp_path: Path, shape: Shape) -> None:
    bench = Bench(tmp_path, shape)
    with bench.opened() as head:
        for ordinal in (1, 2, 3):
            pair = head.capture(DEADLINE_S)
            assert_pair(pair)
            assert (pair.trigger_ordinal, pair.taken_at.tzinfo is None) == (ordinal, False)
            assert (pair.left_serial, pair.right_serial) == head.serials
            seen = head.preview(DEADLINE_S)
            assert seen is not None and seen.left.shape == (HEIGHT // 2, WIDTH // 2, 3)
        assert bench.emulated.head.flashes == 3
        assert_pair(head.capture(DEADLINE_S))
    assert bench.backend.open_handles == 0


def test_the_preview_follows_the_light_of_the_day(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.opened(QUICK + "preview_us = 100\n") as head:
        means = []
        for _ in range(4):
            seen = head.preview(DEADLINE_S)
            assert seen is not None
            means.append(seen.left.mean())
    assert means[0] < 5 and 50 < means[-1] < 140


DAMAGED = (
    Fault.SHORT_FRAME,
    Fault.LONG_FRAME,
    Fault.NO_TRAILER,
    Fault.DISCARDED,
    Fault.OVERRUN,
    Fault.STALL,
)
OUTCOMES: list[tuple[Fault, type[DeviceError]]] = [
    *((fault, FrameIncomplete) for fault in DAMAGED),
    (Fault.BABBLE, FrameIncomplete),
    (Fault.LINK_ERROR, FrameIncomplete),
    (Fault.NO_LEADER, CaptureTimeout),
    (Fault.BLOCK_GAP, CaptureTimeout),
    (Fault.SILENT, CaptureTimeout),
    (Fault.UNPLUG_MID_FRAME, CameraUnplugged),
    (Fault.DARK, FlashMissing),
    (Fault.BROWN_OUT, CameraPowerLost),
    (Fault.NO_MEMORY, UsbMemoryShort),
]


@pytest.mark.parametrize(("fault", "leaf"), OUTCOMES, ids=lambda value: str(value))
def test_what_spoils_a_pair_is_said_and_the_next_one_is_whole(
    tmp_path: Path, fault: Fault, leaf: type[DeviceError]
) -> None:
    bench = Bench(tmp_path)
    with bench.opened() as head:
        head.capture(DEADLINE_S)
        bench.arm(fault)
        with pytest.raises(leaf) as caught:
            head.capture(BRIEF_S)
        assert caught.value.message.endswith(".") and caught.value.hint
        gone = isinstance(caught.value, CameraUnplugged)
        if not gone:
            assert_pair(head.capture(DEADLINE_S))
    if gone:
        bench.emulated.plug()
        with bench.finder.open() as head:
            assert_pair(head.capture(DEADLINE_S))
    assert bench.backend.open_handles == 0


HARMLESS = (
    Fault.NO_ACK,
    Fault.STALE_ACK,
    Fault.PENDING_ACK,
    Fault.BUSY,
    Fault.MAGIC_IN_PAYLOAD,
)


@pytest.mark.parametrize("fault", HARMLESS)
def test_what_the_driver_cures_costs_no_picture_and_no_second_flash(
    tmp_path: Path, fault: Fault
) -> None:
    bench = Bench(tmp_path)
    with bench.opened() as head:
        head.capture(DEADLINE_S)
        for skip in range(4):
            bench.arm(fault, skip=skip)
            assert_pair(head.capture(DEADLINE_S))
        assert bench.emulated.head.flashes == 5


def test_a_follower_that_misses_its_trigger_is_named_and_stays_in_step(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.opened() as head:
        head.capture(DEADLINE_S)
        bench.cameras[1].faults.arm(Fault.SILENT)
        with pytest.raises(CaptureTimeout, match="the right one none"):
            head.capture(BRIEF_S)
        for _ in range(3):
            assert_pair(head.capture(DEADLINE_S))


def test_a_late_picture_is_never_taken_for_the_next(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.opened() as head:
        head.capture(DEADLINE_S)
        with pytest.raises(CaptureTimeout):
            head.capture(0.005)
        for _ in range(3):
            before = bench.emulated.head._ordinal
            pair = head.capture(DEADLINE_S)
            assert_pair(pair)
            assert bench.emulated.head._ordinal == before + 1


def refused(registers: Registers) -> ClockSample:
    raise CameraRefused("It has no such register.")


@pytest.mark.parametrize("latched", [True, False], ids=["by the feature", "not at all"])
def test_cameras_without_the_register_that_latches_their_clock(
    tmp_path: Path, latched: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(eyes, "latch_clock", refused)
    if not latched:
        monkeypatch.setattr(eyes, "has", lambda features, name: name != "TimestampLatch")
    bench = Bench(tmp_path)
    with bench.opened() as head:
        assert_pair(head.capture(DEADLINE_S))
        assert head._head is not None
        assert all((eye.clock is not None) is latched for eye in head._head.eyes)
        bench.cameras[1].faults.arm(Fault.SILENT)
        with pytest.raises(CaptureTimeout):
            head.capture(BRIEF_S)
        for _ in range(3):
            assert_pair(head.capture(DEADLINE_S))


def test_swapped_eyes_are_swapped_back_by_the_file(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    for camera in bench.cameras:
        camera.faults.arm(Fault.SWAPPED_EYES, ALWAYS)
    with bench.opened() as head:
        pair = head.capture(DEADLINE_S)
        assert np.array_equal(pair.right[:, DISPARITY:], pair.left[:, :-DISPARITY])
    swapped = f'left = "{RIGHT_SERIAL}"\nright = "{LEFT_SERIAL}"\n'
    # The flash stays with the camera that has it.
    with bench.opened(QUICK + swapped) as head:
        assert head.serials == (RIGHT_SERIAL, LEFT_SERIAL)
        assert_pair(head.capture(DEADLINE_S))


def test_nothing_stays_of_an_earlier_file(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.opened() as head:
        before = [camera.settings.snapshot() for camera in bench.cameras]
    odd = 'pixel_format = "Mono8"\nwhite_balance_red = 3\nthroughput_bytes_per_s = 5000000\n'
    with bench.opened(QUICK + odd) as head:
        assert head.capture(DEADLINE_S).pixel_format is PixelFormat.MONO8
    with bench.opened() as head:
        assert [camera.settings.snapshot() for camera in bench.cameras] == before
        assert head.capture(DEADLINE_S).pixel_format is PixelFormat.BAYER_RG8


def test_a_head_that_goes_before_it_answers_its_trigger_is_starved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = NodeMap.command

    def command(features: NodeMap, name: str) -> CommandFeature:
        if name == eyes.FIRE:
            raise CameraUnplugged("The camera is gone.")
        return usual(features, name)

    # The other eye is slow to give up.
    monkeypatch.setattr(eyes, "SLICE_S", 0.1)
    bench = Bench(tmp_path)
    with bench.opened() as head:
        monkeypatch.setattr(NodeMap, "command", command)
        with pytest.raises(CameraPowerLost):
            head.capture(DEADLINE_S)


def test_a_line_that_is_not_there_is_told(tmp_path: Path) -> None:
    with Bench(tmp_path).opened(QUICK + 'charged_line = "Line99"\n') as head:
        assert any("Line99" in note for note in head.notes)


def test_an_unplugged_head_is_found_again_by_its_serials_and_set_up_as_before(
    tmp_path: Path,
) -> None:
    bench = Bench(tmp_path)
    with bench.opened(QUICK + "exposure_us = 250\ngain_db = 2\n") as head:
        assert "taken for the left camera" in head.notes[0]
        head.capture(DEADLINE_S)
        before = bench.cameras[0].settings.snapshot()
        bench.emulated.unplug()
        with pytest.raises(CameraUnplugged):
            head.capture(DEADLINE_S)
    with pytest.raises(CameraUnplugged, match="No camera is plugged in"):
        bench.finder.open()
    # In the other order, so that the sockets change.
    for camera in reversed(bench.cameras):
        bench.bus.plug(camera)
    with bench.finder.open() as head:
        assert head.serials == (LEFT_SERIAL, RIGHT_SERIAL)
        assert head.notes == ()
        assert_pair(head.capture(DEADLINE_S))
        assert bench.cameras[0].settings.snapshot() == before


def test_one_missing_eye_is_named(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.opened():
        pass
    bench.bus.unplug(bench.cameras[1])
    with pytest.raises(CameraUnplugged, match=f"right camera {RIGHT_SERIAL}"):
        bench.finder.open()


def test_a_camera_that_fell_silent_is_soon_given_back_and_works_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bootstrap, "_SHORTEST_RESPONSE_S", 0.01)
    bench = Bench(tmp_path)
    finder = bench.finder
    with bench.opened() as head:
        head.capture(DEADLINE_S)
        for camera in bench.cameras:
            camera.faults.arm(Fault.NO_ACK, ALWAYS)
        with pytest.raises(CameraSilent):
            head.attend()
        commands: list[object] = []
        attempt = ControlChannel._attempt

        def counted(channel: ControlChannel, packet: bytes, ack_bytes: int) -> Ack:
            commands.append(channel)
            return attempt(channel, packet, ack_bytes)

        monkeypatch.setattr(ControlChannel, "_attempt", counted)
    # Each costs a second: those that find out, and one to stop it.
    assert max(Counter(commands).values()) <= ATTEMPTS + 1
    for camera in bench.cameras:
        camera.faults.disarm(Fault.NO_ACK)
    with finder.open() as head:
        assert_pair(head.capture(DEADLINE_S))


def test_what_a_crashed_program_left_running_is_stopped(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    crashed = bench.finder.open()
    crashed.capture(DEADLINE_S)
    # Its process ended: nothing was stopped, and its handles are gone.
    with bench.finder.open() as head:
        assert_pair(head.capture(DEADLINE_S))
    crashed.close()


@pytest.mark.parametrize(
    ("fault", "leaf"), [(Fault.IN_USE, CameraBusy), (Fault.KERNEL_DRIVER, None)]
)
def test_a_held_camera(tmp_path: Path, fault: Fault, leaf: type[DeviceError] | None) -> None:
    bench = Bench(tmp_path)
    bench.arm(fault)
    if leaf is not None:
        with pytest.raises(leaf):
            bench.finder.open()
    with bench.finder.open() as head:
        assert_pair(head.capture(DEADLINE_S))
    assert bench.backend.open_handles == 0


def test_a_forbidden_camera_prints_the_rule(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.emulated.unplug()
    for camera in bench.cameras:
        bench.bus.plug(camera, permitted=False)
    with pytest.raises(CameraForbidden) as caught:
        bench.finder.open()
    assert "ef0500" in caught.value.hint


def test_a_usb_2_port_is_told_and_works(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.emulated.plug(Speed.HIGH)
    with bench.opened() as head:
        assert sum("USB 2" in note for note in head.notes) == 2
        assert_pair(head.capture(DEADLINE_S))


def test_what_a_camera_lacks_is_told_and_pictures_are_taken(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    wrong = 'pixel_format = "BayerRG12p"\nexposure_us = 5\nwhite_balance_red = 40\n'
    with bench.opened(QUICK + wrong) as head:
        told = " ".join(head.notes)
        for word in ("PixelFormat", "ExposureTime", "BalanceRatio", LEFT_SERIAL, RIGHT_SERIAL):
            assert word in told
        head.capture(DEADLINE_S)


def test_a_trigger_that_the_camera_does_not_have_is_an_error(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.write(QUICK + 'trigger = "Line9"\n')
    with pytest.raises(DeviceError, match="TriggerSource"):
        bench.finder.open()
    assert bench.backend.open_handles == 0


@pytest.mark.parametrize(
    ("shape", "layout", "words"),
    [
        (Shape.TWO_DEVICES, "side-by-side", "look like one eye's"),
        (Shape.TWO_DEVICES, "alternating", "look like one eye's"),
        (Shape.SIDE_BY_SIDE, "stacked", "look like both eyes' side by side"),
        (Shape.ALTERNATING, "side-by-side", "look like the left and the right eye's in turn"),
    ],
)
def test_a_layout_that_the_pictures_do_not_look_like_is_told(
    tmp_path: Path, shape: Shape, layout: str, words: str
) -> None:
    bench = Bench(tmp_path, shape)
    with bench.opened(QUICK + f'layout = "{layout}"\n') as head:
        assert sum(words in note and "`layout`" in note for note in head.notes) == 1
    for fitting in ("", f'layout = "{shape}"\n'):
        with bench.opened(QUICK + fitting) as head:
            assert not [note for note in head.notes if "layout" in note]


def test_a_camera_that_another_program_cut_is_known_by_its_own_size(tmp_path: Path) -> None:
    bench = Bench(tmp_path, Shape.SIDE_BY_SIDE)
    with bench.opened() as head:
        assert head._head is not None
        head._head.leader.features.integer("Width").value = HEIGHT
    with bench.opened() as head:
        assert_pair(head.capture(DEADLINE_S))


def test_a_layout_of_two_devices_for_one_that_carries_both_is_named(tmp_path: Path) -> None:
    bench = Bench(tmp_path, Shape.SIDE_BY_SIDE)
    bench.write('layout = "two-devices"\n')
    with pytest.raises(CameraUnplugged, match="Only one of the head's two cameras") as caught:
        bench.finder.open()
    assert "side by side" in caught.value.hint and "`layout`" in caught.value.hint


def test_pictures_that_the_layout_waits_for_in_vain_point_to_it(tmp_path: Path) -> None:
    with (
        Bench(tmp_path).opened(QUICK + 'layout = "alternating"\n') as head,
        pytest.raises(CaptureTimeout, match="1 of 2 pictures") as caught,
    ):
        head.capture(BRIEF_S)
    assert "`layout`" in caught.value.hint


def test_one_eye_alone_is_no_head(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.bus.unplug(bench.cameras[1])
    with pytest.raises(CameraUnsupported, match="one eye"):
        bench.finder.open()
    assert bench.backend.open_handles == 0


def test_a_timer_lights_the_flash_as_long_as_told(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    timed = 'strobe_source = "Timer0Active"\nflash_us = 150\n'
    with bench.opened(QUICK + timed) as head:
        half = head.capture(DEADLINE_S).left.mean()
    with bench.opened() as head:
        assert 0.4 < half / head.capture(DEADLINE_S).left.mean() < 0.65


def test_a_line_that_triggers_gives_the_picture_taken_before_it_was_asked_for(
    tmp_path: Path,
) -> None:
    bench = Bench(tmp_path)
    with bench.opened(QUICK + 'trigger = "Line0"\nshutter_line = "Line0"\n') as head:
        taken: list[RawPair] = []
        pressed = threading.Event()
        head.watch_shutter(pressed.set)
        assert head.preview(DEADLINE_S) is None
        for _ in range(2):
            pressed.clear()
            time.sleep(0.35)  # a second press within this time would be the same one
            bench.cameras[0].press_shutter()
            assert pressed.wait(DEADLINE_S)
            taken.append(head.capture(DEADLINE_S))
        for pair in taken:
            assert_pair(pair)
        with pytest.raises(CaptureTimeout):
            head.capture(BRIEF_S)


def test_the_heads_own_shutter_is_heard_between_pictures(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    pressed = threading.Semaphore(0)
    with bench.opened(QUICK + 'shutter_line = "Line0"\n') as head:
        head.watch_shutter(lambda: pressed.release())
        head.capture(DEADLINE_S)
        assert not pressed.acquire(timeout=0.2)
        bench.cameras[0].press_shutter()
        assert pressed.acquire(timeout=DEADLINE_S)
        bench.emulated.unplug()
    assert not [t for t in threading.enumerate() if t.name == "shutter"]


def wait_until(true: Callable[[], bool]) -> None:
    ends_s = time.monotonic() + 5
    while not true():
        assert time.monotonic() < ends_s
        time.sleep(0.01)


def test_a_head_that_nobody_uses_is_given_back_and_woken_by_the_next_picture(
    tmp_path: Path,
) -> None:
    bench = Bench(tmp_path)
    with bench.opened(QUICK + "rest_after_s = 1\n") as head:
        head.capture(DEADLINE_S)
        wait_until(lambda: bench.backend.open_handles == 0)
        assert not bench.cameras[0].shutter.running
        assert_pair(head.capture(DEADLINE_S))
        assert bench.backend.open_handles == 2


def test_a_camera_that_came_during_the_rest_is_not_taken_for_an_eye(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.opened(QUICK + "rest_after_s = 1\n") as head:
        head.capture(DEADLINE_S)
        wait_until(lambda: bench.backend.open_handles == 0)
        # By its serial number it would be the left one.
        other = Camera(Identity("AAA-00"), SMALL, bench.emulated.head)
        bench.bus.plug(other)
        assert_pair(head.capture(DEADLINE_S))
        assert not other.shutter.running


def test_a_layout_that_is_mended_counts_from_the_next_opening_on(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.opened() as head:
        assert head.serials == (LEFT_SERIAL, RIGHT_SERIAL)
    with bench.opened(QUICK + 'layout = "side-by-side"\n') as head:
        assert head.serials == (LEFT_SERIAL, LEFT_SERIAL)
    with bench.opened() as head:
        assert head.serials == (LEFT_SERIAL, RIGHT_SERIAL)
        assert_pair(head.capture(DEADLINE_S))


def test_a_flash_line_is_dark_while_aiming(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.opened() as head:
        head.preview(DEADLINE_S)
        strobe = LINES[STROBE_LINE]
        assert bench.cameras[0].settings.chosen("LineSource", strobe) == "Off"
        head.capture(DEADLINE_S)
        assert bench.cameras[0].settings.chosen("LineSource", strobe) == "ExposureActive"


def test_settings_that_cannot_be_are_refused_before_anything_is_opened(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.write("exposure = 3\n")
    with pytest.raises(CameraSettingsInvalid, match="exposure_us"):
        bench.finder.open()


def test_a_leader_that_is_no_eye_is_refused(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.write('leader = "EMU-OTHER"\n')
    with pytest.raises(CameraSettingsInvalid, match="no camera of this head"):
        bench.finder.open()
    assert bench.backend.open_handles == 0


def test_endless_faults_of_the_link_end_in_an_error(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.opened() as head:
        bench.arm(Fault.LINK_ERROR, ALWAYS)
        for _ in range(3):
            with pytest.raises((FrameIncomplete, TransferFault, CaptureTimeout)):
                head.capture(BRIEF_S)
        bench.cameras[0].faults.disarm(Fault.LINK_ERROR)
        assert_pair(head.capture(DEADLINE_S))


def test_what_was_set_and_went_wrong_is_in_a_log_of_its_own(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with camera_log(tmp_path / "logs"), bench.opened() as head:
        bench.arm(Fault.DISCARDED)
        with pytest.raises(FrameIncomplete):
            head.capture(DEADLINE_S)
    with bench.opened() as head:
        head.capture(DEADLINE_S)
    told = (tmp_path / "logs" / "camera.log").read_text()
    for words in (
        "'ExposureTime': 300.0",
        "DeviceTemperature 38.5",
        "FrameIncomplete",
        "1 spoiled",
    ):
        assert words in told
    assert told.count("was set up") == 2
