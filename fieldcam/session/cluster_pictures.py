"""A small numbered picture of each cluster, for a report.

The app's own process never imports this: it loads the image library.
"""

from __future__ import annotations

from collections.abc import Iterable
from datetime import date
from pathlib import Path

from sqlite_utils import Database

from fieldcam.analysis.direct import decode_stored
from fieldcam.calibration.cameras import own_camera
from fieldcam.calibration.rectification import develop
from fieldcam.errors import ImageUnreadable, StorageError
from fieldcam.growth.from_tracks import TrackedCluster
from fieldcam.report.thumbnails import cluster_thumbnail
from fieldcam.session.over_days.block_growth import KnownCluster
from fieldcam.store.captures import SavedCapture, load_raw
from fieldcam.store.queries.counted import CountedPicture
from fieldcam.store.queries.resuming import saved_capture
from fieldcam.store.readings import stored_reading
from fieldcam.values import Fruitlet, ImageU8


def cluster_pictures(
    database: Database, clusters: Iterable[tuple[KnownCluster, TrackedCluster]], until: date
) -> dict[int, bytes]:
    """JPEGs by tag: the last picture up to a day, each fruitlet with the number of its track.

    Clusters without a picture, and pictures whose files are gone or damaged, are left out.
    """
    found = {}
    for known, tracked in clusters:
        picture = _last_picture(known, until)
        if picture is not None and (data := _drawn(database, picture, tracked)) is not None:
            found[tracked.tag_id] = data
    return found


def _last_picture(known: KnownCluster, until: date) -> CountedPicture | None:
    """Of the last visit's pictures the one that shows most."""
    visits = [visit for visit in known.rows.visits if visit.day <= until and visit.pictures]
    return max(visits[-1].pictures, key=lambda picture: picture.living) if visits else None


def _drawn(database: Database, picture: CountedPicture, tracked: TrackedCluster) -> bytes | None:
    saved = saved_capture(database, picture.capture)
    if saved is None:
        return None
    try:
        left = _rectified_left(saved)
    except (StorageError, ImageUnreadable):
        return None
    return cluster_thumbnail(left, _numbered(database, picture, tracked))


def _rectified_left(saved: SavedCapture) -> ImageU8:
    """Pairs without a calibration of their own are rectified already, or as good as."""
    pair = develop(load_raw(saved, decode_stored))
    if saved.calibration is None:
        return pair.left
    return own_camera(Path(saved.calibration), pair.size_px).rectify(pair).left


def _numbered(
    database: Database, picture: CountedPicture, tracked: TrackedCluster
) -> dict[str, Fruitlet]:
    numbers = {
        place.fruitlet: str(track.number)
        for track in tracked.tracks
        for visit in track.visits.values()
        for place in visit.places
        if place.reading == picture.reading
    }
    reading = stored_reading(database, picture.reading)
    return {numbers[f.id]: f for f in reading.fruitlets if f.id in numbers}
