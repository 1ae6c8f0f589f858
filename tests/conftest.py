"""What several test files share: the folder of real cases, and how many tests used it."""

from __future__ import annotations

import os
from collections.abc import Generator
from pathlib import Path

import pytest

REAL = Path(__file__).resolve().parents[2] / "shared" / "real"

RAN = pytest.StashKey[int]()
SKIPPED = pytest.StashKey[int]()


@pytest.fixture(scope="session")
def real() -> Path:
    """The folder of photographs, pairs and calibrations that nobody here made."""
    if REAL.is_dir():
        return REAL
    reason = f"the real cases are not at {REAL}"
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


def pytest_configure(config: pytest.Config) -> None:
    config.stash[RAN] = config.stash[SKIPPED] = 0


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
    ran, skipped = config.stash[RAN], config.stash[SKIPPED]
    terminalreporter.write_line(f"Tests on real input: {ran} ran, {skipped} skipped.")
