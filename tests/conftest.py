"""What several test files share: the folder of real cases, and what was measured on it."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
from called_commands import CAMERA_INFO, HEIGHT, WIDTH, FakePipeline
from drawn_tags import tag_cells
from hypothesis import HealthCheck, settings
from made_readings import CAMERA, made_fruitlet, made_reading
from watched_analysis import HERE, PATIENT, Watch, Watched

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.status import Limits
from fieldcam.values import Flag, Reason, ReasonCode, Status, Verdict
from fieldcam.vision.pipeline import Pipeline

if TYPE_CHECKING:
    from emulated_camera.bus import UsbBus
    from emulated_camera.plugged_bus import PluggedBus
    from emulated_camera.shapes import StereoHead

# How long an example takes says more about the machine than about the code.
settings.register_profile("checks", deadline=None, max_examples=150)
settings.register_profile(
    "fuzz",
    deadline=None,
    max_examples=int(os.environ.get("FUZZ_EXAMPLES", "5000")),
    suppress_health_check=list(HealthCheck),
)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "checks"))

REAL = Path(__file__).resolve().parents[2] / "shared" / "real"

MEASURED = "measured"


@pytest.fixture(scope="session")
def real() -> Path:
    """The folder of photographs, pairs and calibrations that nobody here made."""
    if REAL.is_dir():
        return REAL
    reason = f"the real cases are not at {REAL}"
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture
def served_bus() -> Iterator[PluggedBus]:
    """A USB bus that other processes see through real libusb, in its `environment`."""
    from emulated_camera.bus import UsbBus
    from emulated_camera.plugged_bus import PluggedBus, why_not

    if reason := why_not():
        pytest.skip(reason)
    with PluggedBus(UsbBus()) as served:
        yield served


@pytest.fixture
def usb_bus(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> UsbBus:
    """The only USB bus that pyusb sees in this process; timeouts take no time."""
    import usb.core
    from emulated_camera.backend import EmulatedBackend
    from emulated_camera.bus import UsbBus
    from emulated_camera.clocks import SteppedClock

    bus = UsbBus(SteppedClock())
    backend, find = EmulatedBackend(bus), usb.core.find
    monkeypatch.setattr(usb.core, "find", lambda **how: find(**how | {"backend": backend}))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return bus


@pytest.fixture
def stereo_cameras(usb_bus: UsbBus) -> StereoHead:
    """Two small cameras of one head, plugged in."""
    from emulated_camera.pictures import gradients
    from emulated_camera.sensor import Sensor
    from emulated_camera.shapes import Shape, stereo_head

    head = stereo_head(usb_bus, Shape.TWO_DEVICES, gradients(64, 48), Sensor(width_px=64))
    head.plug()
    return head


@pytest.fixture
def note(record_property: Callable[[str, object], None]) -> Callable[[str], None]:
    """Takes a line that is printed after all tests, whether they passed or not."""
    return partial(record_property, MEASURED)


@pytest.fixture
def watch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Watch]:
    monkeypatch.setenv("PYTHONPATH", f"{HERE}{os.pathsep}{HERE.parent}")
    with ExitStack() as stack:

        def start(
            work: str = "Scripted", limits: Limits = PATIENT, data: Path | None = None
        ) -> Watched:
            watched = Watched(Setup(CAMERA, data=data), tmp_path / "a.log", limits, work)
            stack.enter_context(watched.supervisor)
            return watched

        yield start


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    """A pair whose left file is this says, once read, which process works on it."""
    path = tmp_path / "gate"
    os.mkfifo(path)
    return path


@pytest.fixture
def own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is read from or written to the user's own folders."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "xdg-data"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "xdg-state"))
    monkeypatch.delenv("FIELDCAM_DATA", raising=False)


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, Path, Path]:
    """Left and right image with tag 17 in them, and their calibration."""
    left = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    card = cv2.resize(tag_cells(17), (96, 96), interpolation=cv2.INTER_NEAREST)
    left[200:296, 300:396] = card[..., None]
    paths = tmp_path / "left.png", tmp_path / "right.png", tmp_path / "calibration.yml"
    cv2.imwrite(str(paths[0]), left)
    cv2.imwrite(str(paths[1]), np.roll(left, -100, axis=1))
    paths[2].write_text(CAMERA_INFO.format(width=WIDTH, height=HEIGHT, tx=-45.6))
    return paths


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A data folder with two networks that can be verified, though not run."""
    folder = tmp_path / "data" / "models"
    folder.mkdir(parents=True)
    content = b"network"
    entry = {"file": "net.onnx", "sha256": sha256(content).hexdigest()}
    (folder / "net.onnx").write_bytes(content)
    manifest = {
        "schema": 1,
        "segmentation": {**entry, "score_threshold": 0.5},
        "stereo": {**entry, "search_px": 32, "multiple": 16, "scale": 0.5},
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder.parent


@pytest.fixture
def pipeline(monkeypatch: pytest.MonkeyPatch) -> FakePipeline:
    reasons = (Reason(ReasonCode.FEWER_THAN_BEFORE, "2 fruitlets where 3 were counted."),)
    reading = made_reading(
        [
            made_fruitlet(0, (300.0, 200.0), 9.13),
            made_fruitlet(1, (330.0, 210.0), None, flags=(Flag.HIDDEN,)),
            made_fruitlet(2, (500.0, 100.0), 7.0, in_target=False, cluster=1),
        ],
        Verdict(Status.CONFIRM, reasons),
    )
    fake = FakePipeline(reading)
    monkeypatch.setattr(Pipeline, "from_models", lambda models: fake)
    return fake


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if "real" in getattr(item, "fixturenames", ()):
            item.add_marker("real")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """From the reports, which come from every process that ran tests."""
    every = (each for group in terminalreporter.stats.values() for each in group)
    reports = [each for each in every if isinstance(each, pytest.TestReport)]
    ended = [each for each in reports if each.when == "call" or each.skipped]
    measured = [line for each in ended for key, line in each.user_properties if key == MEASURED]
    for line in sorted(map(str, measured)):
        terminalreporter.write_line(f"Measured: {line}")
    on_real = [each.skipped for each in ended if "real" in each.keywords]
    skipped = sum(on_real)
    terminalreporter.write_line(
        f"Tests on real input: {len(on_real) - skipped} ran, {skipped} skipped."
    )
