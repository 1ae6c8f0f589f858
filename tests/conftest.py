"""What several test files share: the folder of real cases, and what was measured on it."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings
from made_readings import CAMERA
from watched_analysis import HERE, PATIENT, Watch, Watched

from fieldcam.analysis.requests import Setup
from fieldcam.analysis.status import Limits

if TYPE_CHECKING:
    from emulated_camera.plugged_bus import PluggedBus

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

RAN = pytest.StashKey[int]()
SKIPPED = pytest.StashKey[int]()
MEASURED = pytest.StashKey[list[str]]()


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
def note(request: pytest.FixtureRequest) -> Callable[[str], None]:
    """Takes a line that is printed after all tests, whether they passed or not."""
    return request.config.stash[MEASURED].append


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


def pytest_configure(config: pytest.Config) -> None:
    config.stash[RAN] = config.stash[SKIPPED] = 0
    config.stash[MEASURED] = []


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if "real" in getattr(item, "fixturenames", ()):
            item.add_marker("real")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if item.get_closest_marker("real"):
        if report.skipped:
            item.config.stash[SKIPPED] += 1
        elif report.when == "call":
            item.config.stash[RAN] += 1
    return report


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    for line in config.stash[MEASURED]:
        terminalreporter.write_line(f"Measured: {line}")
    ran, skipped = config.stash[RAN], config.stash[SKIPPED]
    terminalreporter.write_line(f"Tests on real input: {ran} ran, {skipped} skipped.")
