"""Aravis, an independent host, judges the emulated camera."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from emulated_camera.descriptors import Identity
from emulated_camera.pictures import gradients
from emulated_camera.plugged_bus import PluggedBus
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import LEFT_SERIAL, RIGHT_SERIAL, Shape, stereo_head

TOOL = "arv-tool-0.8"
PYTHON = Path("/usr/bin/python3")
"""The system's, for which the distribution packages PyGObject."""
PATIENCE_S = 120


def name(identity: Identity) -> str:
    """As Aravis calls a device."""
    return f"{identity.vendor}-{identity.guid}-{identity.serial}"


LEFT = name(Identity(LEFT_SERIAL))
SOURCE = gradients(1440, 1080)
IMPORT = """
import gi
gi.require_version("Aravis", "0.8")
from gi.repository import Aravis
"""
STREAM = (
    IMPORT
    + """
import json, sys

camera = Aravis.Camera.new(sys.argv[1])
device = camera.get_device()
device.set_string_feature_value("ExposureAuto", "Off")
camera.set_exposure_time(400.0)
camera.set_frame_rate(100.0)
for chunk in ("FrameID", "ExposureTime"):
    device.set_string_feature_value("ChunkSelector", chunk)
    device.set_boolean_feature_value("ChunkEnable", True)
device.set_boolean_feature_value("ChunkModeActive", True)
camera.uv_set_usb_mode(getattr(Aravis.UvUsbMode, sys.argv[2]))
stream = camera.create_stream(None, None)
for _ in range(10):
    stream.push_buffer(Aravis.Buffer.new_allocate(camera.get_payload()))
camera.start_acquisition()
parser = camera.create_chunk_parser()
frames = []
for _ in range(20):
    buffer = stream.timeout_pop_buffer(5_000_000)
    frames.append([buffer.get_status() == Aravis.BufferStatus.SUCCESS, buffer.get_frame_id()])
    data = buffer.get_data()
    size = [buffer.get_image_width(), buffer.get_image_height(), len(data)]
    chunks = [
        parser.get_integer_value(buffer, "ChunkFrameID"),
        parser.get_float_value(buffer, "ChunkExposureTime"),
    ]
    stream.push_buffer(buffer)
camera.stop_acquisition()
statistics = stream.get_statistics()
print(json.dumps({
    "exposure_us": camera.get_exposure_time(),
    "rate_hz": camera.get_frame_rate(),
    "frames": frames,
    "size": size,
    "chunks": chunks,
    "failures": statistics.n_failures,
}))
"""
)


@pytest.fixture
def plugged(served_bus: PluggedBus) -> PluggedBus:
    stereo_head(served_bus.bus, Shape.TWO_DEVICES, SOURCE, Sensor()).plug()
    return served_bus


def tool(served: PluggedBus, *arguments: str) -> str:
    if shutil.which(TOOL) is None:
        pytest.skip(f"{TOOL} is not installed (apt install aravis-tools-cli)")
    done = subprocess.run(
        [TOOL, *arguments],
        env=served.environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=True,
    )
    return done.stdout


def test_it_finds_both_devices(plugged: PluggedBus) -> None:
    assert sorted(tool(plugged).splitlines()) == [
        f"{name(Identity(serial))} (USB3)" for serial in (LEFT_SERIAL, RIGHT_SERIAL)
    ]


def test_it_reads_every_feature(plugged: PluggedBus) -> None:
    found = tool(plugged, "-n", LEFT, "values")
    for line in (
        "'DeviceModelName' = 'Flash Eye 1440'",
        "'DeviceTemperature' = 38.5 C",
        "'PixelFormat' = 'BayerRG8'",
        "'PixelSize' = 8",
        "'PayloadSize' = 1555200",
        "'ExposureTime' = 500 us",
        "'BalanceRatio' = 1",
        "'LineStatus' = false",
    ):
        assert line in found, line


def test_it_writes_what_it_then_reads(plugged: PluggedBus) -> None:
    tool(plugged, "-n", LEFT, "control", "Width=1024", "ExposureTime=750", "Gain=6.5")
    tool(plugged, "-n", LEFT, "control", "LineSelector=Line1", "LineSource=ExposureActive")
    found = tool(plugged, "-n", LEFT, "values")
    for line in (
        "'Width' = 1024",
        "'PayloadSize' = 1105920",
        "'ExposureTime' = 750 us",
        "'Gain' = 6.5 dB",
        "'LineSource' = 'ExposureActive'",
    ):
        assert line in found, line


@pytest.mark.parametrize("mode", ["SYNC", "ASYNC"])
def test_it_streams_without_a_failure(plugged: PluggedBus, mode: str) -> None:
    found = streamed(plugged, mode)
    assert (found["exposure_us"], found["rate_hz"]) == (400.0, 100.0)
    assert found["size"] == [1440, 1080, 1440 * 1080 + 8 + 2 * 16]
    assert found["chunks"] == [found["frames"][-1][1], 400.0]
    assert [good for good, _ in found["frames"]] == [True] * 20
    ids = [number for _, number in found["frames"]]
    assert ids == sorted(set(ids))
    assert found["failures"] == 0


def streamed(served: PluggedBus, mode: str) -> dict[str, Any]:
    if (
        not PYTHON.exists()
        or subprocess.run([PYTHON, "-c", IMPORT], capture_output=True).returncode
    ):
        pytest.skip("Aravis is not there for Python (apt install gir1.2-aravis-0.8 python3-gi)")
    done = subprocess.run(
        [PYTHON, "-c", STREAM, LEFT, mode],
        env=served.environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    assert done.returncode == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer
