"""docs/commands.md says what the parsers say."""

from __future__ import annotations

from pathlib import Path

from fieldcam.cli.main import build_parser
from fieldcam.cli.reference import reference
from fieldcam.errors import ExitCode

PAGE = Path(__file__).resolve().parents[2] / "docs/commands.md"


def test_the_page_is_what_make_reference_writes() -> None:
    assert PAGE.read_text() == reference(), "run `make reference`"


def test_each_command_of_the_help_and_each_exit_status_is_on_it() -> None:
    page = reference()
    for action in build_parser()._actions:
        for name in action.choices or ():
            assert f"## `fieldcam {name}" in page
    assert all(f"| {int(code)} | {code.meaning} |" in page for code in ExitCode)


def test_options_with_their_values_and_choices() -> None:
    page = reference()
    assert "| `--calibration FILE` | of this camera; see --rectify |" in page
    assert "| `--stereo raft/sgbm` |" in page
    assert "%(" not in page
