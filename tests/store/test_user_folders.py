"""Where the user's own files lie, also for a service's user, who has no home folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from fieldcam.camera.head.settings import settings_paths
from fieldcam.camera.usb3vision.description import cache_folder
from fieldcam.cli.main import main
from fieldcam.errors import BadInput, ExitCode, StorageError
from fieldcam.store.folder import DataKind, data_path, data_path_if_any
from fieldcam.tui.questions import answers

Capture = pytest.CaptureFixture[str]
NO_FOLDERS = ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME")


@pytest.fixture
def homeless(monkeypatch: pytest.MonkeyPatch) -> None:
    """As `env -u HOME` of a user that /etc/passwd does not know."""

    def unknown() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in (*NO_FOLDERS, "FIELDCAM_DATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", unknown)


@pytest.mark.usefixtures("homeless")
@pytest.mark.parametrize("kind", list(DataKind))
def test_without_a_home_data_needs_a_name(tmp_path: Path, kind: DataKind) -> None:
    with pytest.raises(StorageError, match=r"no home folder.*--data"):
        data_path(None, kind)
    assert data_path_if_any(None, kind) is None
    assert data_path(tmp_path / "data", kind) == tmp_path / "data"


@pytest.mark.usefixtures("homeless")
def test_without_a_home_cameras_are_found(tmp_path: Path) -> None:
    assert settings_paths(None) == ()
    assert settings_paths(tmp_path) == (tmp_path / "camera.toml",)
    assert cache_folder().is_absolute()


@pytest.mark.usefixtures("homeless")
@pytest.mark.parametrize(
    ("command", "code"),
    [
        (["models", "list"], ExitCode.OK),
        (["growth"], ExitCode.STORAGE),
        (["doctor"], ExitCode.STORAGE),
        (["demo", "--headless", "--clusters", "1", "--days", "0"], ExitCode.STORAGE),
    ],
)
def test_without_a_home_commands_say_one_sentence(
    capsys: Capture, command: list[str], code: ExitCode
) -> None:
    assert main(command) == code
    said = capsys.readouterr().err
    assert "Traceback" not in said and ("no home folder" in said) is (code is ExitCode.STORAGE)


@pytest.mark.parametrize("kind", list(DataKind))
def test_a_users_folder_that_cannot_be_one_is_told(
    monkeypatch: pytest.MonkeyPatch, kind: DataKind
) -> None:
    monkeypatch.delenv("FIELDCAM_DATA", raising=False)
    monkeypatch.setenv("XDG_DATA_HOME", "/dev/null")
    with pytest.raises(StorageError, match="/dev/null is a file, not a folder") as refused:
        data_path(None, kind)
    assert "--data" in refused.value.hint


@pytest.mark.parametrize("command", [["--data", "", "growth"], ["growth", "--data", ""]])
def test_an_empty_name_is_not_the_current_folder(capsys: Capture, command: list[str]) -> None:
    assert main(command) == ExitCode.BAD_INPUT
    assert "Argument --data: the folder's name is empty" in capsys.readouterr().err


@pytest.mark.usefixtures("homeless")
def test_without_a_home_a_defect_is_still_logged(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def fail(data: Path | None) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("fieldcam.cli.models.find_models", fail)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    assert main(["models", "list"]) == ExitCode.DEFECT
    assert "ZeroDivisionError" in (tmp_path / "fieldcam.log").read_text()
    assert str(tmp_path) in capsys.readouterr().err


@pytest.mark.parametrize("of", ["option", "variable"])
@pytest.mark.parametrize(
    ("named", "why"),
    [
        ("~nosuchuser/x", "No home folder is known for ~nosuchuser"),
        ("loop/x", "leads to itself"),
        ("x" * 300, "too long"),
    ],
)
def test_a_folder_that_cannot_be_is_told_in_one_sentence(
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    of: str,
    named: str,
    why: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    monkeypatch.setenv("FIELDCAM_DATA", named if of == "variable" else "elsewhere")
    option = ["--data", named] if of == "option" else []
    assert main([*option, "models", "list"]) == ExitCode.BAD_INPUT
    assert why in capsys.readouterr().err


def test_a_file_of_a_user_that_does_not_exist_is_asked_for_again() -> None:
    with pytest.raises(BadInput, match="nosuchuser"):
        answers.file("~nosuchuser/route.csv")
