"""The app's simulated orchard: a row whose days are walked in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import cast

import pytest
from made_readings import CAMERA
from made_states import AIM
from stored_walks import raw_pair

from fieldcam.app import simulated
from fieldcam.app.rendered import kept_row
from fieldcam.app.simulated import _visit
from fieldcam.camera.aimed import AimedCamera
from fieldcam.camera.simulated import SimulatedRow
from fieldcam.cli import demo, main
from fieldcam.errors import ExitCode
from fieldcam.session.events import Changed, Listener, LiveEvent
from fieldcam.session.state import CameraState
from fieldcam.store.folder import DataKind
from fieldcam.store.queries.walks import walk_route
from fieldcam.store.rows.judgements import Skip
from fieldcam.store.store import Store, open_store
from fieldcam.tui.text.telling import banner

ROW = SimulatedRow((8, 9, 10), CAMERA, date(2026, 5, 21))


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(tmp_path, DataKind.SIMULATED) as opened:
        yield opened


def test_the_next_day_comes_when_the_first_one_is_done(store: Store) -> None:
    block = kept_row(store, 1, ROW, "by hand")
    assert kept_row(store, 1, ROW, "by hand") == block
    day, visit = _visit(store, block, ROW.first_day, (0, 2, 4))
    stops = walk_route(store.database, visit).stops
    assert (day, [(stop.tag_id, stop.tree_label) for stop in stops]) == (
        0,
        [(8, "1"), (9, "1"), (10, "2")],
    )
    store.append(*(Skip(visit, tag_id) for tag_id in ROW.tag_ids))
    assert _visit(store, block, ROW.first_day, (0, 2, 4))[0] == 2


def test_a_day_with_an_undecided_picture_is_gone_on_with(store: Store) -> None:
    block = kept_row(store, 1, ROW, "by hand")
    _, visit = _visit(store, block, ROW.first_day, (0, 2))
    store.append(*(Skip(visit, tag_id) for tag_id in ROW.tag_ids[1:]))
    store.save(raw_pair(simulated=True), visit=visit, tag_expected=ROW.tag_ids[0])
    assert walk_route(store.database, visit).next_tag() is None
    assert _visit(store, block, ROW.first_day, (0, 2)) == (0, visit)


class NoRenderer:
    """Knows the row, and renders nothing of it."""

    def __init__(self, seed: int, clusters: int) -> None:
        self.row = ROW

    def close(self) -> None:
        """It holds nothing."""


class Unseeing:
    """A camera that makes no picture."""

    def make_first(self, tag_id: int, deadline_s: float) -> None:
        assert tag_id in ROW.tag_ids


@pytest.mark.parametrize("walked", [0, 1, 2])
def test_the_demo_says_what_comes_after_the_day(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, walked: int
) -> None:
    """With so many of two days walked before."""
    with open_store(tmp_path, DataKind.SIMULATED) as store:
        for _ in range(walked):
            _, visit = _visit(store, kept_row(store, 1, ROW, "by hand"), ROW.first_day, (0, 2))
            store.append(*(Skip(visit, tag_id) for tag_id in ROW.tag_ids))
        if walked == 2:
            for seed in range(2):
                store.save(raw_pair(seed, simulated=True), visit=visit, tag_expected=9)
                store.append(Skip(visit, 9))
    lines: list[str] = []
    told: list[LiveEvent] = []

    cameras: list[dict[int, int]] = []

    def camera(pictures: object, taken: dict[int, int]) -> AimedCamera:
        cameras.append(taken)
        return cast(AimedCamera, Unseeing())

    def run(start: Callable[[Listener], None], found: Sequence[str], *_: object) -> None:
        lines.extend(found)
        start(told.append)

    def start_walk(*given: object) -> None:
        cast(Listener, given[-1])(Changed(AIM))

    monkeypatch.setattr(simulated, "OrchardProcess", NoRenderer)
    monkeypatch.setattr(simulated, "AimedCamera", camera)
    monkeypatch.setattr(simulated, "tricks", lambda *_: ())
    monkeypatch.setattr(simulated, "run", run)
    monkeypatch.setattr(simulated, "start_walk", start_walk)
    simulated.walk_simulated_row(tmp_path, 1, 3, (0, 2))
    (event,) = told
    assert isinstance(event, Changed)
    sentence = banner(replace(event.state, tag_id=None, shown=None)).sentence
    assert ("next day" in sentence) == (walked == 0)
    assert (f"after 2 days: to begin anew remove {tmp_path}" in sentence) == (walked > 0)
    assert cameras == [{8: 0, 9: 2 if walked == 2 else 0, 10: 0}]
    assert any(str(tmp_path) in line for line in lines) == (walked == 2)


def test_at_a_terminal_the_demo_is_the_app(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[object, ...]] = []
    monkeypatch.setattr(demo, "at_a_terminal", lambda: True)
    monkeypatch.setattr(demo, "checked_models", lambda data: None)
    monkeypatch.setattr(
        "fieldcam.app.simulated.walk_simulated_row", lambda *arguments: asked.append(arguments)
    )
    command = ["--data", str(tmp_path), "demo", "--clusters", "3", "--days", "0,3"]
    assert main(command) == ExitCode.OK
    assert asked == [(tmp_path, 1, 3, (0, 3))]


def test_who_waits_for_a_rendered_picture_is_told_why() -> None:
    taking = replace(AIM, camera=CameraState.EXPOSING, patience=simulated.PATIENCE)
    assert "The demo is rendering it" in banner(taking).sentence
