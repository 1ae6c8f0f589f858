"""The app's simulated orchard: a camera that is aimed, and days that are walked in turn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from threading import Event
from typing import cast

import pytest
from made_readings import CAMERA
from stored_walks import raw_pair

from fieldcam.camera.simulated import AimedCamera, OrchardProcess, SimulatedRow, SimulatedVisit
from fieldcam.cli import demo, main
from fieldcam.errors import CameraUnplugged, CaptureTimeout, ExitCode
from fieldcam.simulator import Block
from fieldcam.store.folder import DataKind
from fieldcam.store.judgement_rows import Skip
from fieldcam.store.store import Store, open_store
from fieldcam.store.walks import walk_route
from fieldcam.tui.simulated import _block, _visit
from fieldcam.values import RawPair

ROW = SimulatedRow((8, 9, 10), CAMERA, date(2026, 5, 21))
PATIENCE_S = 10.0


@dataclass
class ToldOrchard:
    """Renders at once, or only when it may."""

    may: Event = field(default_factory=Event)
    asked: list[SimulatedVisit] = field(default_factory=list)
    row: SimulatedRow = ROW

    def render(self, visit: SimulatedVisit) -> RawPair:
        self.asked.append(visit)
        self.may.wait(PATIENCE_S)
        return raw_pair(len(self.asked), simulated=True)


def aimed(orchard: ToldOrchard, day: int = 2) -> AimedCamera:
    return AimedCamera(cast(OrchardProcess, orchard), day)


def test_what_is_aimed_at_and_its_neighbour_are_rendered_ahead() -> None:
    orchard = ToldOrchard()
    orchard.may.set()
    with aimed(orchard) as camera:
        camera.aim(9)
        assert camera.capture(PATIENCE_S).simulated
        camera.aim(10)
        camera.capture(PATIENCE_S)
    assert orchard.asked[:2] == [SimulatedVisit(1, 2), SimulatedVisit(2, 2)]


def test_the_same_cluster_again_is_another_view() -> None:
    orchard = ToldOrchard()
    orchard.may.set()
    with aimed(orchard) as camera:
        camera.aim(8)
        for _ in range(2):
            camera.capture(PATIENCE_S)
    assert {SimulatedVisit(0, 2, 0), SimulatedVisit(0, 2, 1)} <= set(orchard.asked)


def test_an_orchard_that_takes_too_long_is_said() -> None:
    orchard = ToldOrchard()
    with aimed(orchard) as camera, pytest.raises(CaptureTimeout):
        camera.aim(8)
        try:
            camera.capture(0.01)
        finally:
            orchard.may.set()


def test_the_orchards_process_plans_the_same_block_and_can_be_ended() -> None:
    orchard = OrchardProcess(1, 2)
    tags = tuple(cluster.tag_id for cluster in Block.plan(seed=1, clusters=2).clusters)
    assert orchard.row.tag_ids == tags
    orchard.close()
    with pytest.raises(CameraUnplugged):
        orchard.render(SimulatedVisit(0, 0))


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(tmp_path, DataKind.SIMULATED) as opened:
        yield opened


def test_the_next_day_comes_when_the_first_one_is_done(store: Store) -> None:
    block = _block(store, 1, ROW)
    assert _block(store, 1, ROW) == block
    day, visit = _visit(store, block, ROW.first_day, (0, 2, 4))
    stops = walk_route(store.database, visit).stops
    assert (day, [(stop.tag_id, stop.tree_label) for stop in stops]) == (
        0,
        [(8, "1"), (9, "1"), (10, "2")],
    )
    store.append(*(Skip(visit, tag_id) for tag_id in ROW.tag_ids))
    assert _visit(store, block, ROW.first_day, (0, 2, 4))[0] == 2


def test_at_a_terminal_the_demo_is_the_app(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[object, ...]] = []
    monkeypatch.setattr(demo, "_at_a_terminal", lambda: True)
    monkeypatch.setattr(demo, "checked_models", lambda data: None)
    monkeypatch.setattr(
        "fieldcam.tui.simulated.walk_simulated_row", lambda *arguments: asked.append(arguments)
    )
    command = ["--data", str(tmp_path), "demo", "--clusters", "3", "--days", "0,3"]
    assert main(command) == ExitCode.OK
    assert asked == [(tmp_path, 1, 3, (0, 3))]
