"""A camera without hardware: it follows the walker, and misbehaves on command."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from threading import Event, Timer
from time import monotonic

import numpy as np
import pytest
from stored_walks import raw_pair

from fieldcam.app.hand_aimed import tricks
from fieldcam.camera import aimed
from fieldcam.camera.aimed import OF_THE_CABLE, SHRUNK, AimedCamera, Mishap, Wanted, walked_up
from fieldcam.camera.simulated import OrchardDay, OrchardProcess, SimulatedVisit
from fieldcam.errors import CameraUnplugged, CaptureTimeout, ImageUnreadable
from fieldcam.simulator import BlockPlan, Spoiling
from fieldcam.values import Calibration, RawPair

PATIENCE_S = 10.0


@dataclass
class ToldPictures:
    """Makes pictures at once, or only when it may."""

    may: Event = field(default_factory=Event)
    asked: list[Wanted] = field(default_factory=list)
    serials: tuple[str, str] = ("L", "R")
    calibration: Calibration | None = None
    tag_ids: tuple[int, ...] = (8, 9, 10)
    damaged: bool = False

    def make(self, wanted: Wanted) -> RawPair:
        self.asked.append(wanted)
        self.may.wait(PATIENCE_S)
        if self.damaged:
            raise ImageUnreadable("left.png is damaged.", "Copy it again.")
        return raw_pair(len(self.asked), (12, 18), simulated=True)


@pytest.fixture
def pictures() -> ToldPictures:
    found = ToldPictures()
    found.may.set()
    return found


@pytest.fixture
def camera(pictures: ToldPictures) -> Iterator[AimedCamera]:
    with AimedCamera(pictures) as opened:
        yield opened
        pictures.may.set()


def test_the_first_picture_is_there_before_its_shutter(pictures: ToldPictures) -> None:
    pictures.may.clear()
    camera = AimedCamera(pictures)
    Timer(0.2, pictures.may.set).start()
    camera.make_first(9, PATIENCE_S)
    assert pictures.asked[0] == Wanted(9, 0) and pictures.may.is_set()
    pictures.may.clear()
    with camera:
        started = monotonic()
        assert camera.capture(PATIENCE_S) is not None
        assert monotonic() - started < 0.5
        pictures.may.set()


def test_what_is_aimed_at_and_its_neighbour_are_made_ahead(
    pictures: ToldPictures, camera: AimedCamera
) -> None:
    camera.aim(9)
    assert camera.capture(PATIENCE_S).simulated
    camera.aim(10)
    camera.capture(PATIENCE_S)
    assert {Wanted(9, 0), Wanted(10, 0)} <= set(pictures.asked)
    assert Wanted(9, 1) not in pictures.asked[: pictures.asked.index(Wanted(10, 0))]


def test_the_same_cluster_again_is_another_view(
    pictures: ToldPictures, camera: AimedCamera
) -> None:
    for _ in range(2):
        camera.capture(PATIENCE_S)
    assert {Wanted(8, 0), Wanted(8, 1)} <= set(pictures.asked)


def test_views_go_on_where_an_earlier_walk_stopped(pictures: ToldPictures) -> None:
    with AimedCamera(pictures, {8: 4}) as camera:
        camera.capture(PATIENCE_S)
        camera.aim(9)
        camera.capture(PATIENCE_S)
    assert {Wanted(8, 4), Wanted(9, 0)} <= set(pictures.asked)
    assert Wanted(8, 0) not in pictures.asked


def test_pictures_that_take_too_long_are_said(pictures: ToldPictures, camera: AimedCamera) -> None:
    camera.capture(PATIENCE_S)
    pictures.may.clear()
    camera.aim(10)
    with pytest.raises(CaptureTimeout) as caught:
        camera.capture(0.01)
    assert caught.value.hint


def test_a_slow_camera_gives_one_picture_less(
    camera: AimedCamera, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(aimed, "SLOW_S", 0.01)
    camera.misbehave(Mishap.SLOW)
    with pytest.raises(CaptureTimeout):
        camera.capture(PATIENCE_S)
    assert camera.capture(PATIENCE_S).simulated


def test_an_unplugged_camera_is_gone_until_it_is_plugged_in(camera: AimedCamera) -> None:
    camera.misbehave(Mishap.UNPLUGGED)
    for use in (camera.open, lambda: camera.capture(1), lambda: camera.preview(1)):
        with pytest.raises(CameraUnplugged) as caught:
            use()
        assert caught.value.hint
    camera.close()
    camera.misbehave(None)
    assert camera.open().capture(PATIENCE_S).simulated


def test_the_cable_can_be_pulled_in_the_middle_of_a_picture(
    pictures: ToldPictures, camera: AimedCamera
) -> None:
    camera.capture(PATIENCE_S)
    pictures.may.clear()
    camera.aim(10)
    began = monotonic()
    Timer(0.05, camera.misbehave, [Mishap.UNPLUGGED]).start()
    with pytest.raises(CameraUnplugged):
        camera.capture(PATIENCE_S)
    assert monotonic() - began < PATIENCE_S / 2


@pytest.mark.parametrize("mishap", [each for each in Mishap if each not in OF_THE_CABLE])
def test_a_mishap_spoils_one_picture(
    pictures: ToldPictures, camera: AimedCamera, mishap: Mishap
) -> None:
    camera.capture(PATIENCE_S)
    camera.misbehave(mishap)
    for _ in range(2):
        camera.capture(PATIENCE_S)
    spoiled = [wanted for wanted in pictures.asked if wanted.spoiled is not None]
    assert spoiled == [Wanted(8, 1, mishap)]
    assert Wanted(8, 2) in pictures.asked
    Spoiling(mishap.value)  # the simulator knows it


def test_the_preview_is_the_picture_that_comes_next(
    pictures: ToldPictures, camera: AimedCamera
) -> None:
    camera.capture(PATIENCE_S)
    pictures.may.clear()
    camera.aim(10)
    assert camera.preview(1) is None
    pictures.may.set()
    camera.capture(PATIENCE_S)
    while (preview := camera.preview(1)) is None:
        pass
    assert preview.left.shape == (12 // SHRUNK, 18 // SHRUNK)
    assert (preview.shrunk, preview.flash_ready) == (SHRUNK, False)


def test_a_picture_that_cannot_be_made_is_said(pictures: ToldPictures, camera: AimedCamera) -> None:
    pictures.damaged = True
    camera.aim(10)
    with pytest.raises(ImageUnreadable):
        camera.capture(PATIENCE_S)


def test_who_walks_up_sees_the_cluster_grow() -> None:
    picture = np.zeros((90, 120), np.uint8)
    picture[30:60, 40:80] = 255
    shares = [float((walked_up(picture, seconds) > 0).mean()) for seconds in (0.0, 1.5, 3.0, 9.0)]
    assert shares == sorted(shares)
    assert shares[0] < shares[1] < shares[2] == shares[3] == pytest.approx(1 / 9, abs=0.01)


def test_its_own_shutter_can_be_pressed(camera: AimedCamera) -> None:
    heard: list[str] = []
    camera.press()
    camera.watch_shutter(lambda: heard.append("pressed"))
    camera.press()
    assert heard == ["pressed"]


def test_each_mishap_is_a_command_of_the_palette(camera: AimedCamera) -> None:
    commands = {trick.name: trick for trick in tricks(camera, Mishap)}
    assert len(commands) == len(Mishap) + 2
    pressed: list[str] = []
    camera.watch_shutter(lambda: pressed.append("pressed"))
    for command in commands.values():
        assert command.name.startswith("Camera: ") and command.play().endswith(".")
    assert len({command.does for command in commands.values()}) == len(commands)
    assert pressed == ["pressed"]
    commands["Camera: unplug it"].play()
    with pytest.raises(CameraUnplugged):
        camera.preview(1)
    commands["Camera: plug it in"].play()
    assert camera.capture(PATIENCE_S).simulated


def test_a_closed_camera_takes_no_pictures(camera: AimedCamera) -> None:
    camera.close()
    camera.close()
    with pytest.raises(CameraUnplugged):
        camera.capture(1)


def test_the_orchards_process_plans_the_same_block_and_can_be_ended() -> None:
    orchard = OrchardProcess(1, 2)
    tags = tuple(cluster.tag_id for cluster in BlockPlan.plan(seed=1, clusters=2).clusters)
    assert orchard.row.tag_ids == OrchardDay(orchard, 2).tag_ids == tags
    orchard.close()
    with pytest.raises(CameraUnplugged):
        orchard.picture(SimulatedVisit(0, 0))


def test_a_day_in_the_orchard_names_the_fault() -> None:
    asked: list[SimulatedVisit] = []

    class Asked:
        row = type("Row", (), {"tag_ids": (8, 9), "calibration": None})

        def picture(self, visit: SimulatedVisit) -> RawPair:
            asked.append(visit)
            return raw_pair(1)

    day = OrchardDay(Asked(), 2)  # type: ignore[arg-type]
    day.make(Wanted(9, 1, Mishap.DARK))
    day.make(Wanted(8, 0))
    assert asked == [SimulatedVisit(1, 2, 1, "dark"), SimulatedVisit(0, 2, 0)]
