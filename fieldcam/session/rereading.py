"""A block's pictures read once more in another way, to compare; nothing of it is stored.

The app's own process never imports this: it loads the networks.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from sqlite_utils import Database

from fieldcam.analysis.direct import DirectAnalyst
from fieldcam.errors import ImageUnreadable, StorageError
from fieldcam.growth.evaluation.named import NamedCluster
from fieldcam.growth.places import Place, View
from fieldcam.report.scoring import SAME_FRUITLET_IOU, mask_iou
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.queries.resuming import saved_capture
from fieldcam.values import ClusterReading, Fruitlet, Settings
from fieldcam.vision.pipeline import Pipeline


def read_again(
    database: Database, clusters: Iterable[NamedCluster], pipeline: Pipeline, settings: Settings
) -> Iterator[NamedCluster]:
    """The same clusters by another reading of each picture; names and marks go with the masks.

    The operator's words on who is who stay with the readings that they were said of. Pictures
    whose files are gone or damaged are left out.
    """
    for cluster in clusters:
        names: dict[Place, str] = {}
        visits = []
        for visit in cluster.visits:
            views = []
            for view in visit.views:
                if (again := _read(database, view, pipeline, settings)) is not None:
                    same = _same(view.reading, again)
                    names |= _moved(cluster.names, view.id, same)
                    views.append(_with(view, again, same))
            visits.append(replace(visit, views=tuple(views)))
        yield NamedCluster(cluster.tag_id, tuple(visits), names)


def _read(
    database: Database, view: View, pipeline: Pipeline, settings: Settings
) -> ClusterReading | None:
    saved = saved_capture(database, row_of(database, "reading", view.id)["capture"])
    if saved is None:
        return None
    analyst = DirectAnalyst(pipeline, view.reading.calibration, settings)
    try:
        return analyst.analyse(saved, view.reading.expectation)
    except (StorageError, ImageUnreadable):
        return None


def _same(before: ClusterReading, after: ClusterReading) -> dict[int, int]:
    """Ids of the fruitlets of two readings of one picture, matched by their masks."""
    found = {}
    for fruitlet in before.fruitlets:
        best = max(after.fruitlets, key=lambda f: mask_iou(f.mask, fruitlet.mask), default=None)
        if best is not None and _overlap(best, fruitlet):
            found[fruitlet.id] = best.id
    return found


def _overlap(one: Fruitlet, other: Fruitlet) -> bool:
    return mask_iou(one.mask, other.mask) >= SAME_FRUITLET_IOU


def _moved(names: Mapping[Place, str], reading: str, same: Mapping[int, int]) -> dict[Place, str]:
    return {
        Place(reading, same[place.fruitlet]): name
        for place, name in names.items()
        if place.reading == reading and place.fruitlet in same
    }


def _with(view: View, reading: ClusterReading, same: Mapping[int, int]) -> View:
    """A target that was corrected is found again by its fruitlets; by itself it is as read."""
    return View(
        view.id,
        reading,
        frozenset(same[k] for k in view.struck_out if k in same),
        frozenset(same[k] for k in view.fallen if k in same),
        None if view.cluster is None else _cluster(view, reading, same),
    )


def _cluster(view: View, reading: ClusterReading, same: Mapping[int, int]) -> int | None:
    own = (f.id for f in view.reading.fruitlets if f.cluster == view.cluster)
    wanted = {same[k] for k in own if k in same}
    clusters = [f.cluster for f in reading.fruitlets if f.id in wanted and f.cluster is not None]
    return max(set(clusters), key=clusters.count, default=None)
