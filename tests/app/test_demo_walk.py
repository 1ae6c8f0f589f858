"""The demo walks every cluster on every day and puts sizes beside the truth."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from made_readings import CAMERA, TAG, disc_mask, made_fruitlet, made_reading
from recorded_pairs import AtOnce, Encoding

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.status import AnalysisState, AnalysisStatus, Limits
from fieldcam.analysis.work import DirectAnalyst
from fieldcam.camera.simulated import SimulatedCamera, SimulatedVisit
from fieldcam.cli import main
from fieldcam.errors import (
    AnalysisOff,
    AnalysisTimeout,
    CameraUnplugged,
    CaptureTimeout,
    ExitCode,
    StorageFull,
)
from fieldcam.simulator import BlockPlan, Faults
from fieldcam.store.connection import connect_read_only, rows
from fieldcam.store.objects import Objects
from fieldcam.store.space import Space
from fieldcam.store.store import DATABASE_NAME
from fieldcam.values import (
    Calibration,
    ClusterReading,
    Expectation,
    PixelFormat,
    RawPair,
    Settings,
    StereoPair,
    TagPose,
)
from fieldcam.vision.pipeline import Pipeline


def fake_capture(
    block: BlockPlan, cluster_index: int, day: int, view: int = 0, faults: Faults | None = None
) -> SimpleNamespace:
    """A grey pair with two target fruitlets, which grow by 0.5 mm a day."""
    image = np.full((4, 6, 3), 10 * cluster_index + day, np.uint8)
    taken_at = datetime(2026, 5, 21 + day, tzinfo=UTC)
    raw = RawPair(image, image, PixelFormat.RGB8, taken_at, 0, 0, "L", "R", 1, simulated=True)
    fruitlets = tuple(
        SimpleNamespace(
            id=i,
            in_target=True,
            diameter_mm=9.0 + 0.5 * day,
            visible=disc_mask(100.0 + 50 * i, 100.0, 18),
            visible_fraction=0.9,
        )
        for i in range(2)
    )
    tag_id = block.clusters[cluster_index].tag_id
    truth = SimpleNamespace(tag_id=tag_id, fruitlets=fruitlets, target=fruitlets)
    return SimpleNamespace(raw=raw, calibration=CAMERA, truth=truth)


@dataclass
class FakePipeline:
    """Sees the first of the two fruitlets, always at 9.1 mm."""

    asked: list[Expectation]
    too_slow: set[int] = field(default_factory=set)
    """Which calls, counted from 0, end in no reading."""
    off: bool = False

    def analyse(
        self,
        pair: StereoPair,
        calibration: Calibration,
        expectation: Expectation,
        settings: Settings,
    ) -> ClusterReading:
        if self.off:
            raise AnalysisOff("The analysis is off.")
        self.asked.append(expectation)
        if len(self.asked) - 1 in self.too_slow:
            raise AnalysisTimeout("The analysis took longer than 10 s.")
        assert expectation.tag_id is not None
        fruitlets = [made_fruitlet(0, (100.0, 100.0), 9.1)]
        return made_reading(
            fruitlets, tag=replace(TAG, id=expectation.tag_id), expectation=expectation
        )


@dataclass(frozen=True)
class AnalysisAtOnce(AtOnce):
    """In the calling thread, by a made-up pipeline."""

    pipeline: FakePipeline

    @property
    def status(self) -> AnalysisStatus:
        if self.pipeline.off:
            return AnalysisStatus(AnalysisState.STOPPED, last_error="The analysis is off.")
        return AnalysisStatus(AnalysisState.READY)

    def look(
        self, image: Path, shrunk: int, calibration: Path | None
    ) -> Future[tuple[TagPose, ...]]:
        raise AssertionError("nobody aims")

    def restart(self) -> None:
        """It is never off for good."""

    def close(self) -> None:
        """It holds nothing."""


@pytest.fixture
def pipeline(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> FakePipeline:
    folder = tmp_path / "models"
    folder.mkdir()
    (folder / "net.onnx").write_bytes(b"network")
    entry = {"file": "net.onnx", "sha256": sha256(b"network").hexdigest(), "score_threshold": 0.5}
    entry |= {"search_px": 32, "multiple": 16, "scale": 0.5}
    manifest = {"schema": 1, "segmentation": entry, "stereo": entry}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    fake = FakePipeline([])

    def start(
        setup: Setup, data: Path, changed: Callable[[AnalysisState], None], limits: Limits
    ) -> AnalysisAtOnce:
        direct = DirectAnalyst(cast(Pipeline, fake), setup.camera, Settings())
        return AnalysisAtOnce(Encoding(direct), fake)

    monkeypatch.setattr("fieldcam.app.rig.start_analysis", start)
    monkeypatch.setattr("fieldcam.simulator.capture", fake_capture)
    return fake


WALK = ["demo", "--headless", "--clusters", "2", "--days", "0,2"]


def test_the_document_holds_each_stop_beside_its_truth(
    tmp_path: Path, pipeline: FakePipeline, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*WALK, "--json", "--data", str(tmp_path)]) == ExitCode.OK
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    tags = [cluster.tag_id for cluster in BlockPlan.plan(seed=1, clusters=2).clusters]
    stops = [(capture["tag"], capture["day"]) for capture in document["captures"]]
    assert stops == [(tag, day) for day in (0, 2) for tag in tags]
    first, second = document["captures"][2]["fruitlets"]
    assert (first["diameter_mm"], first["true_diameter_mm"]) == (9.1, 10.0)
    assert not second["found"] and second["true_id"] == 1
    assert document["simulated"] is True
    assert document["summary"]["captures"] == 4
    assert document["summary"]["bias_mm"] == pytest.approx((0.1 - 0.9) / 2)


def test_the_second_visit_expects_what_the_first_one_counted(
    tmp_path: Path, pipeline: FakePipeline
) -> None:
    main([*WALK, "--data", str(tmp_path)])
    tags = [cluster.tag_id for cluster in BlockPlan.plan(seed=1, clusters=2).clusters]
    expected = [Expectation(tag) for tag in tags] + [Expectation(tag, 1) for tag in tags]
    assert pipeline.asked == expected


def test_without_a_terminal_the_demo_needs_no_screen(
    tmp_path: Path, pipeline: FakePipeline, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*WALK[:1], *WALK[2:], "--data", str(tmp_path)]) == ExitCode.OK
    assert "captures 4" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("too_slow", "read", "told"),
    [
        ({1}, 4, 0),  # tried again at once, when nothing else waits
        ({1, 2}, 4, 1),  # with the next day's pictures
        ({0, 1, 2, 3}, 4, 2),
        ({3, 4}, 4, 1),  # at the end
        ({3, 4, 5}, 3, 2),
    ],
)
def test_what_was_not_read_is_tried_again(
    tmp_path: Path,
    pipeline: FakePipeline,
    capsys: pytest.CaptureFixture[str],
    too_slow: set[int],
    read: int,
    told: int,
) -> None:
    pipeline.too_slow = too_slow
    assert main([*WALK, "--data", str(tmp_path)]) == ExitCode.OK
    out, err = capsys.readouterr()
    assert f"captures 4 stored, {read} read, sizes" in out
    assert err.count("took longer than 10 s.") == told
    kept = rows(connect_read_only(tmp_path / DATABASE_NAME), "SELECT action FROM capture_now")
    assert sum(row["action"] == "accept" for row in kept) == read


def test_pictures_of_an_analysis_that_is_off_are_stored_and_told(
    tmp_path: Path, pipeline: FakePipeline, capsys: pytest.CaptureFixture[str]
) -> None:
    pipeline.off = True
    assert main([*WALK, "--data", str(tmp_path)]) == ExitCode.OK
    out, err = capsys.readouterr()
    assert "captures 4 stored, 0 read, sizes" in out
    assert err.count("The analysis is off.") == 4


def test_a_camera_that_goes_ends_the_walk_after_what_it_gave(
    tmp_path: Path,
    pipeline: FakePipeline,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    capture = SimulatedCamera.capture

    def once(camera: SimulatedCamera, deadline_s: float) -> RawPair:
        if pipeline.asked:
            raise CaptureTimeout("No pair came.")
        return capture(camera, deadline_s)

    monkeypatch.setattr(SimulatedCamera, "capture", once)
    assert main([*WALK, "--data", str(tmp_path)]) == ExitCode.DEVICE
    out, err = capsys.readouterr()
    assert "day 0: ACCEPT" in out and "No pair came." in err
    kept = rows(connect_read_only(tmp_path / DATABASE_NAME), "SELECT action FROM capture_now")
    assert [row["action"] for row in kept] == ["accept"]


def test_a_full_disk_ends_the_walk_before_any_picture(
    tmp_path: Path, pipeline: FakePipeline, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(space: Space) -> None:
        raise StorageFull("Only 3 MB are free.")

    monkeypatch.setattr(Space, "check", full)
    assert main([*WALK, "--data", str(tmp_path)]) == ExitCode.STORAGE
    assert pipeline.asked == []


def test_a_row_that_was_walked_is_walked_again(
    tmp_path: Path, pipeline: FakePipeline, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever was cut off: the sizes of all pictures are printed each time."""
    for times in (1, 2):
        assert main([*WALK, "--data", str(tmp_path)]) == ExitCode.OK
        assert "captures 4 stored, 4 read" in capsys.readouterr().out
        database = connect_read_only(tmp_path / DATABASE_NAME)
        assert len(rows(database, "SELECT id FROM reading")) == 4 * times
        assert len(rows(database, "SELECT id FROM route_now")) == 1


def test_people_are_told_that_nothing_here_is_real(
    tmp_path: Path, pipeline: FakePipeline, capsys: pytest.CaptureFixture[str]
) -> None:
    main([*WALK, "--data", str(tmp_path)])
    out = capsys.readouterr().out
    assert "Simulated orchard" in out
    assert "not found" in out
    assert "+0.10" in out


def test_every_picture_is_kept_and_marked_as_simulated(
    tmp_path: Path, pipeline: FakePipeline
) -> None:
    main([*WALK, "--data", str(tmp_path)])
    database = connect_read_only(tmp_path / DATABASE_NAME)
    kept = rows(
        database,
        "SELECT simulated, left_file, status FROM capture JOIN reading"
        " ON reading.capture = capture.id",
    )
    assert len(kept) == 4
    assert all(row["simulated"] == 1 for row in kept)
    assert all(Objects(tmp_path).path(row["left_file"]).is_file() for row in kept)


def test_a_folder_of_real_captures_takes_no_demo(
    tmp_path: Path, pipeline: FakePipeline, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "fieldcam-data.json").write_text('{"schema": 1, "kind": "field"}')
    assert main([*WALK, "--data", str(tmp_path)]) == ExitCode.STORAGE
    assert "holds field captures" in capsys.readouterr().err


def test_the_simulated_camera_is_unplugged_after_its_walk(pipeline: FakePipeline) -> None:
    block = BlockPlan.plan(seed=1, clusters=1)
    with SimulatedCamera(block, [SimulatedVisit(0, 2)]) as camera:
        with pytest.raises(CameraUnplugged):
            _ = camera.last
        assert camera.capture(10).simulated
        assert camera.last.visit == SimulatedVisit(0, 2)
        with pytest.raises(CameraUnplugged):
            camera.capture(10)
