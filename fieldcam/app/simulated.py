"""The app on the simulated orchard, with a data folder of its own."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

from fieldcam.analysis.messages import Setup
from fieldcam.app.hand_aimed import start_walk, tricks
from fieldcam.app.rendered import OPERATOR, RENDER_DEADLINE_S, kept_row
from fieldcam.app.running import run, say
from fieldcam.camera.aimed import AimedCamera, Mishap
from fieldcam.camera.simulated import OrchardDay, OrchardProcess
from fieldcam.models import find_models
from fieldcam.session.events import Changed, Listener, LiveEvent
from fieldcam.session.live import LiveWalk
from fieldcam.session.set_up.setting_up import SetUp
from fieldcam.session.viewing import VisitView
from fieldcam.store.folder import DataKind, data_path
from fieldcam.store.queries.walks import walk_route
from fieldcam.store.recovery.startup import startup_check
from fieldcam.store.rows.row import EntryId
from fieldcam.store.store import Store, open_store
from fieldcam.words import number_of

RENDERING = "The demo renders its first picture, which takes some seconds …"
PATIENCE = "The demo is rendering it; a real camera needs no such time."
NEXT_DAY = "Started again, the demo goes on with its next day."


def walk_simulated_row(data: Path | None, seed: int, clusters: int, days: Sequence[int]) -> None:
    """Run the app until the operator ends it; `data` is what `--data` said."""
    path = data_path(data, DataKind.SIMULATED)
    with ExitStack() as stack:
        store = stack.enter_context(open_store(path, DataKind.SIMULATED))
        orchard = stack.enter_context(closing(OrchardProcess(seed, clusters)))
        found = startup_check(store).sentences
        block = kept_row(store, seed, orchard.row, "by hand")
        day, visit = _visit(store, block, orchard.row.first_day, days)
        last = _last_day(path, days)
        if walk_route(store.database, visit).settled:
            found = (*found, last)
        afterwards = last if day == days[-1] else NEXT_DAY
        set_up = SetUp(store, lambda: orchard.row.first_day + timedelta(days=day))
        set_up.sign_in(OPERATOR)
        set_up.block, set_up.visit = block, visit
        stops = walk_route(store.database, visit).stops
        taken = {stop.tag_id: len(stop.captures) for stop in stops}
        camera = AimedCamera(OrchardDay(orchard, day), taken)
        if (first := VisitView(store, visit).standing()) is not None:
            say(RENDERING)
            camera.make_first(first, RENDER_DEADLINE_S)

        def start(listener: Listener) -> LiveWalk:
            analysis = Setup(orchard.row.calibration, data=data_path(data))

            def tell(event: LiveEvent) -> None:
                if isinstance(event, Changed):
                    state = replace(event.state, afterwards=afterwards, patience=PATIENCE)
                    event = replace(event, state=state)
                listener(event)

            return start_walk(store, set_up.visit or visit, camera, analysis, tell)

        run(start, found, tricks(camera, Mishap), find_models(data_path(data)), set_up)


def _last_day(path: Path, days: Sequence[int]) -> str:
    return (
        f"The demo ends after {number_of(len(days), 'day')}: to begin anew remove {path},"
        " or name another folder with --data."
    )


def _visit(
    store: Store, block: EntryId, first_day: date, days: Sequence[int]
) -> tuple[int, EntryId]:
    """The first of the days on which something is left to do or to decide, else the last one."""
    for day in days:
        visit = store.visit(block, first_day + timedelta(days=day))
        if not walk_route(store.database, visit).settled:
            break
    return day, visit
