"""Fruitlets followed by their ids, for screens that show what was followed."""

from __future__ import annotations

from datetime import date

from fieldcam.session.over_days.growing import FollowedCluster

from fieldcam.growth.places import Association, Place, Track, TrackedVisit
from fieldcam.growth.records import Presence, Sighting

SURE_OF = {2: 0.6}
"""By the fruitlet's id; 1 for all others."""


def tracked_by_id(
    cluster: FollowedCluster, method: Association = Association.GEOMETRY
) -> tuple[Track, ...]:
    """A fruitlet is the one of the same id on the other days; who is missing has fallen."""
    numbers = {
        f.id for visit in cluster.visits for view in visit.views for f in view.reading.target
    }
    said = {place for word in cluster.words for place in (word.one, word.other)}
    tracks = []
    for number in sorted(numbers):
        visits: dict[date, TrackedVisit] = {}
        for visit in cluster.visits:
            found = [
                (Place(view.id, f.id), f.diameter_mm)
                for view in visit.views
                for f in view.reading.target
                if f.id == number
            ]
            places = tuple(place for place, _ in found)
            sizes = [size for _, size in found if size is not None]
            confidence = SURE_OF.get(number, 1.0) if visits else 1.0
            if sizes:
                sighting = Sighting(Presence.SIZED, max(sizes), confidence)
                visits[visit.day] = TrackedVisit(sighting, places, bool(said & set(places)))
            elif visits:
                visits[visit.day] = TrackedVisit(Sighting(Presence.FALLEN), ())
        tracks.append(Track(number + 1, visits))
    return tuple(tracks)
