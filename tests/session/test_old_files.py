"""Damage of old pictures is found while the app runs, though a start looks only at new ones."""

from __future__ import annotations

from pathlib import Path
from queue import Empty, Queue

import pytest
from live_walks import PATIENCE_S, walked
from stored_walks import FIRST_DAY, MadeWalk, small_store

from fieldcam.session import events
from fieldcam.session.old_files import OldFiles
from fieldcam.store.recovery.integrity import NEWEST
from fieldcam.store.recovery.startup import startup_check
from fieldcam.tui.text.news import news


def season(folder: Path) -> Path:
    """More pictures than a start looks at; the oldest one's left image."""
    with small_store(folder) as store:
        walk = MadeWalk(store)
        visit = walk.visit()
        oldest = walk.take(visit, 11)
        for _ in range(NEWEST + 2):
            walk.take(visit, 12)
    return oldest.left


@pytest.mark.parametrize("missing", [False, True])
def test_the_oldest_damage_is_told(tmp_path: Path, missing: bool) -> None:
    image = season(tmp_path)
    if missing:
        image.unlink()
    else:
        content = bytearray(image.read_bytes())
        content[-1] ^= 1
        image.write_bytes(content)
        with small_store(tmp_path) as store:
            assert startup_check(store).problems == ()
    heard: Queue[events.LiveEvent] = Queue()
    check = OldFiles(tmp_path, heard.put, pause_s=0.0)
    try:
        event = heard.get(timeout=PATIENCE_S)
    finally:
        check.close()
    assert isinstance(event, events.Damaged)
    assert f"tag 11 of {FIRST_DAY:%d %b %Y}" in event.sentence
    told = news(event)
    assert told is not None and told.bad and not told.unsaved


def test_a_sound_folder_is_silent(tmp_path: Path) -> None:
    season(tmp_path)
    heard: Queue[events.LiveEvent] = Queue()
    OldFiles(tmp_path, heard.put, pause_s=0.0)._thread.join(PATIENCE_S)
    with pytest.raises(Empty):
        heard.get_nowait()


def test_a_walk_ends_in_the_middle_of_it(tmp_path: Path) -> None:
    season(tmp_path / "before")
    with walked(tmp_path / "before") as walk:
        walk.start()
