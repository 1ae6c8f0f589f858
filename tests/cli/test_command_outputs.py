"""Where the command's output goes, and what it leaves behind."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fieldcam.cli import main
from fieldcam.errors import ExitCode
from fieldcam.exchange.images import write_png

GREY = np.full((64, 64), 110, np.uint8)


@pytest.mark.parametrize("name", ["picture.jpg", "missing/picture.png", "folder.png"])
def test_an_overlay_that_cannot_be_written_is_refused_before_the_work(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str
) -> None:
    (tmp_path / "folder.png").mkdir()
    pair = [tmp_path / "left.png", tmp_path / "right.png"]
    overlay = ["--calibration", tmp_path / "none.yml", "--overlay", tmp_path / name]
    assert main(["size", *map(str, [*pair, *overlay])]) == ExitCode.BAD_INPUT
    assert name.split("/")[0] in capsys.readouterr().err


@pytest.mark.parametrize("redirection", [">&-", "2>&-", ">/dev/full"])
def test_an_output_that_takes_nothing_is_no_defect(tmp_path: Path, redirection: str) -> None:
    image = tmp_path / "image.png"
    write_png(image, GREY)
    command = f"{shlex.quote(sys.executable)} -m fieldcam tags {shlex.quote(str(image))}"
    done = subprocess.run(
        ["sh", "-c", f"{command} --json {redirection}"], capture_output=True, check=False
    )
    full = redirection == ">/dev/full"
    assert done.returncode == (ExitCode.STORAGE if full else ExitCode.OK)
    assert (b"could not be written" in done.stderr) == full


def test_no_run_leaves_anything_in_the_home_folder(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    image = tmp_path / "image.png"
    write_png(image, GREY)
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("XDG_", "CI", "ORT_"))}
    subprocess.run(
        [sys.executable, "-m", "fieldcam", "segment", str(image)],
        env=environment | {"HOME": str(home)}, check=True, capture_output=True,
    )  # fmt: skip
    assert list(home.rglob("*")) == []
