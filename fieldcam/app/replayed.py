"""The app on a folder of recorded captures, as if each was taken on the walk."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, closing
from datetime import date
from functools import partial
from itertools import groupby
from pathlib import Path

from fieldcam.analysis.messages import Setup
from fieldcam.app.hand_aimed import start_walk, tricks
from fieldcam.app.running import run
from fieldcam.camera.aimed import OF_THE_CABLE, AimedCamera
from fieldcam.camera.replay import RecordedDay, ReplayProcess
from fieldcam.exchange.capture_folder import CaptureFile, read_capture_folder
from fieldcam.models import find_models
from fieldcam.store.folder import DataKind, data_path
from fieldcam.store.queries.walks import walk_route
from fieldcam.store.recovery.startup import startup_check
from fieldcam.store.rows.orchard import Block, Cluster
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store, open_store

Days = dict[date, list[CaptureFile]]


def walk_recorded_folder(data: Path | None, folder: Path) -> None:
    """Run the app until the operator ends it.

    `data` is what `--data` said; without it the captures go to a folder of their
    own, since they were taken before.
    """
    days = by_day(read_capture_folder(folder).captures)
    own = data_path(data)
    path = own if data is not None else own.with_name(f"{own.name}-replay")
    with ExitStack() as stack:
        store = stack.enter_context(open_store(path, DataKind.FIELD))
        process = stack.enter_context(closing(ReplayProcess()))
        found = startup_check(store).sentences
        store.sign_in("replay")
        day, visit = choose_visit(store, folder.resolve().name, days)
        setup = Setup(days[day][0].calibration, data=own)
        camera = AimedCamera(RecordedDay(process, days[day]))
        start = partial(start_walk, store, visit, camera, setup)
        run(start, found, tricks(camera, OF_THE_CABLE), find_models(own))


def by_day(captures: Sequence[CaptureFile]) -> Days:
    """What can be analysed; a day without a calibration stays only where no day has one."""
    usable = [capture for capture in captures if not capture.obstacle] or captures
    return {day: list(taken) for day, taken in groupby(usable, key=lambda capture: capture.day)}


def choose_visit(store: Store, name: str, days: Days) -> tuple[date, EntryId]:
    """The first day on which something is left to do, else the last one; its clusters are known."""
    block = store.block(Block(f"Replay of {name}"))
    for day, captures in days.items():
        visit = store.visit(block, day)
        known = {stop.tag_id for stop in walk_route(store.database, visit).stops}
        tags = dict.fromkeys(capture.tag_id for capture in captures)
        store.append(*(Cluster(block, tag_id) for tag_id in tags if tag_id not in known))
        if walk_route(store.database, visit).next_tag() is not None:
            break
    return day, visit
