"""The head over real libusb, in a process of its own: a pulled plug, a dark flash, both shapes."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from emulated_camera.faults import Fault
from emulated_camera.shapes import Shape, stereo_head
from emulated_camera.uevents import Listeners
from emulated_head import DISPARITY, QUICK, SCENE, SMALL

if TYPE_CHECKING:
    from emulated_camera.plugged_bus import PluggedBus

ROOT = Path(__file__).parents[2]
PATIENCE_S = 30
SCRIPT = f"""
import sys, time
from pathlib import Path
import numpy as np
from fieldcam.camera.finding import HeadFinder
from fieldcam.errors import DeviceError

finder = HeadFinder(Path(sys.argv[1]))
head = None
for _ in sys.stdin:
    try:
        head = head or finder.open()
        pair = head.capture(2.0)
        paired = np.array_equal(pair.left[:, {DISPARITY}:], pair.right[:, :-{DISPARITY}])
        print("pair", paired, head.preview(2.0) is not None)
    except DeviceError as error:
        print(type(error).__name__)
        if head is not None:
            head.close()
        head = None
head.close()
"""


@contextmanager
def head_process(served: PluggedBus, data: Path) -> Iterator[Callable[[], str]]:
    """Gives what takes a picture in a process that sees the bus, and says what came of it."""
    (data / "camera.toml").write_text(QUICK)
    environment = {**served.environment, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(data)}
    with subprocess.Popen(
        [sys.executable, "-u", "-c", SCRIPT, str(data)],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        asked, answers = process.stdin, process.stdout

        def shoot() -> str:
            asked.write("\n")
            asked.flush()
            return answers.readline().strip()

        try:
            yield shoot
            asked.close()
            assert process.wait(PATIENCE_S) == 0
        finally:
            process.kill()


@pytest.mark.parametrize(
    "shape", [Shape.TWO_DEVICES, pytest.param(Shape.SIDE_BY_SIDE, marks=pytest.mark.slow)]
)
def test_pairs_come_and_trouble_is_named(
    served_bus: PluggedBus, shape: Shape, tmp_path: Path
) -> None:
    head = stereo_head(served_bus.bus, shape, SCENE, SMALL)
    head.plug()
    with head_process(served_bus, tmp_path) as shoot:
        assert [shoot(), shoot()] == ["pair True True"] * 2
        head.cameras[0].faults.arm(Fault.DARK)
        assert [shoot(), shoot()] == ["FlashMissing", "pair True True"]
        head.unplug()
        assert [shoot(), shoot()] == ["CameraUnplugged"] * 2
        head.plug()
        assert shoot() == "pair True True"


def test_a_head_is_found_again_though_the_system_told_nothing(
    served_bus: PluggedBus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    head = stereo_head(served_bus.bus, Shape.TWO_DEVICES, SCENE, SMALL)
    head.plug()
    with head_process(served_bus, tmp_path) as shoot:
        assert shoot() == "pair True True"
        monkeypatch.setattr(Listeners, "announce", lambda *message: None)
        head.unplug()
        assert [shoot(), shoot()] == ["CameraUnplugged"] * 2
        head.plug()
        assert shoot() == "pair True True"


LOOKS = """
import gc, os
from fieldcam.camera.usb3vision.devices import attached_cameras, open_attached

def look():
    (camera, *_) = attached_cameras()
    open_attached(camera).close()
    return len(os.listdir("/proc/self/fd"))

gc.disable()
print(look(), *{look() for _ in range(5)})
"""


def test_looking_at_the_bus_leaves_nothing_open(served_bus: PluggedBus) -> None:
    stereo_head(served_bus.bus, Shape.TWO_DEVICES, SCENE, SMALL).plug()
    environment = {**served_bus.environment, "PYTHONPATH": str(ROOT), "LIBUSB_DEBUG": "2"}
    done = subprocess.run(
        [sys.executable, "-c", LOOKS], env=environment, capture_output=True, text=True
    )
    first, *later = done.stdout.split()
    assert later == [first]
    # libusb warns of devices that outlive it, which older versions crash on.
    assert "still referenced" not in done.stderr
