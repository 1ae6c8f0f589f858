"""Commands called as from a shell, with a pair of files and networks that answer."""

from __future__ import annotations

import pytest

from fieldcam.cli import main
from fieldcam.errors import ExitCode
from fieldcam.values import (
    Calibration,
    ClusterReading,
    Expectation,
    Settings,
    StereoPair,
)

WIDTH, HEIGHT = 640, 480
CAMERA_INFO = """\
height: {height}
width: {width}
distortion_model: "plumb_bob"
D: [0.0, 0.0, 0.0, 0.0, 0.0]
K: [760.0, 0.0, 320.0, 0.0, 760.0, 240.0, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [760.0, 0.0, 320.0, {tx}, 0.0, 760.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]
"""
Capture = pytest.CaptureFixture[str]


class FakePipeline:
    """Answers every pair with one reading, and keeps what it was asked."""

    def __init__(self, reading: ClusterReading) -> None:
        self.reading = reading
        self.asked: list[tuple[Expectation | None, Settings | None]] = []

    def analyse(
        self,
        pair: StereoPair,
        calibration: Calibration,
        expectation: Expectation | None = None,
        settings: Settings | None = None,
    ) -> ClusterReading:
        self.asked.append((expectation, settings))
        return self.reading


def run(capsys: Capture, *argv: object) -> tuple[int, str, str]:
    code = main([str(each) for each in argv])
    out, err = capsys.readouterr()
    return code, out, err


def assert_one_sentence(code: int, out: str, err: str, expected: ExitCode) -> None:
    assert code == expected
    assert out == ""
    assert err.startswith("fieldcam: ") and err.endswith((".\n", "?\n"))
    assert len(err.splitlines()) == 1 and "Traceback" not in err
