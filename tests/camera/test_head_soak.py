"""The head for long: plugs pulled at random moments, and pairs at full rate (`make soak`)."""

from __future__ import annotations

import json
import os
import random
import resource
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from emulated_camera.pictures import gradients
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import Shape, stereo_head
from emulated_head import QUICK, Bench

from fieldcam.errors import DeviceError

if TYPE_CHECKING:
    from emulated_camera.plugged_bus import PluggedBus

CYCLES = int(os.environ.get("SOAK_CYCLES", "1000"))
SECONDS = float(os.environ.get("SOAK_SECONDS", "60"))
OPEN_FILES = Path("/proc/self/fd")
ROOT = Path(__file__).parents[2]
WARM_CYCLES = 50
LONGEST_PULL_S = 0.5
PATIENCE_S = 15.0
GROWTH_BYTES = 8 << 20
LATENCY_MS = 60.0


def pages() -> int:
    """Bytes of memory that this process has now."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def one_cycle(bench: Bench, rng: random.Random) -> int:
    """Uses the head until the plug is pulled; gives how many pairs came before."""
    pairs = 0
    pulled = threading.Timer(rng.uniform(0, LONGEST_PULL_S), bench.emulated.unplug)
    pulled.start()
    ends_s = time.monotonic() + PATIENCE_S
    try:
        with bench.finder.open() as head:
            head.watch_shutter(lambda: None)
            while True:
                head.capture(2.0)
                pairs += 1
                head.preview(2.0)
                assert time.monotonic() < ends_s, "the pulled plug was not noticed"
    except DeviceError:
        pulled.join()
        assert time.monotonic() < ends_s, "it hung"
    bench.emulated.plug()
    return pairs


@pytest.mark.slow
@pytest.mark.parametrize("shape", [Shape.TWO_DEVICES, Shape.SIDE_BY_SIDE])
def test_plugs_pulled_at_random_moments_leak_nothing(
    shape: Shape, tmp_path: Path, note: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    bench, rng = Bench(tmp_path, shape), random.Random(11)
    bench.write(QUICK + 'shutter_line = "Line0"\n')
    pairs = sum(one_cycle(bench, rng) for _ in range(WARM_CYCLES))
    before = threading.active_count(), len(list(OPEN_FILES.iterdir()))
    memory = pages()
    pairs += sum(one_cycle(bench, rng) for _ in range(CYCLES - WARM_CYCLES))
    grown = pages() - memory
    note(f"{CYCLES} plugs pulled ({shape}): {pairs} pairs, memory grew by {grown >> 10} KiB")
    assert (threading.active_count(), len(list(OPEN_FILES.iterdir()))) == before
    assert bench.backend.open_handles == 0
    assert grown < GROWTH_BYTES
    assert pairs > CYCLES / 4


@pytest.mark.slow
@pytest.mark.parametrize("shape", [Shape.TWO_DEVICES, Shape.SIDE_BY_SIDE])
def test_thirty_triggered_pairs_a_second(
    served_bus: PluggedBus, shape: Shape, tmp_path: Path, note: Callable[[str], None]
) -> None:
    stereo_head(served_bus.bus, shape, gradients(1440, 1080), Sensor()).plug()
    (tmp_path / "camera.toml").write_text(QUICK)
    done = subprocess.run(
        [sys.executable, str(ROOT / "tests" / "head_rate.py"), str(tmp_path), str(SECONDS)],
        env={**served_bus.environment, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout)
    middle, high, worst = found["ms"]
    note(
        f"{shape}: {found['rate_hz']:.2f} pairs/s, capture to pair beyond exposure "
        f"{middle:.0f} ms median, {high:.0f} ms at 99 %, {worst:.0f} ms worst"
    )
    assert middle <= LATENCY_MS
    assert found["rate_hz"] > 29.9
