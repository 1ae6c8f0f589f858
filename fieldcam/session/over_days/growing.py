"""A cluster as association works on it, out of the store."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from sqlite_utils import Database

from fieldcam.growth.places import Association, ClusterVisit, MatchWord, Place, Track, View
from fieldcam.growth.size_rule import SizeRule
from fieldcam.store.queries.blocks import tag_size_mm
from fieldcam.store.queries.counted import (
    CountedPicture,
    CountedVisit,
    association_words,
    counted_visits,
)
from fieldcam.store.queries.history import CaptureRecord, cluster_history, corrected_target
from fieldcam.store.readings import stored_reading
from fieldcam.store.rows.fruit import AssociationWord
from fieldcam.store.rows.judgements import Answer, MarkKind
from fieldcam.store.rows.row import EntryId
from fieldcam.values import TAG_SIZE_MM, ClusterReading, Status


@dataclass(frozen=True, slots=True)
class ClusterRows:
    """What the rows say of one cluster; equal as long as nothing of it has changed."""

    tag_id: int
    visits: tuple[CountedVisit, ...]
    """The earliest first; none where nothing of it was accepted or marked."""
    words: tuple[AssociationWord, ...]
    """The operator's, the oldest first."""
    tag_size_mm: float = TAG_SIZE_MM
    """Side of the block's cards as it is set up now."""


@dataclass(frozen=True, slots=True, eq=False)
class FollowedCluster:
    """What there is to follow the fruitlets of one cluster by."""

    tag_id: int
    visits: tuple[ClusterVisit, ...]
    words: tuple[MatchWord, ...]


def cluster_rows(database: Database, block: EntryId, tag_id: int) -> ClusterRows:
    """One cluster."""
    size_mm = tag_size_mm(database, block)
    return _with_words(database, tag_id, counted_visits(database, block, tag_id), size_mm)


def rows_with_undecided(database: Database, block: EntryId, tag_id: int) -> ClusterRows:
    """One cluster as if each visit's last picture counted that was read and waits for a word."""
    rows = cluster_rows(database, block, tag_id)
    by_day = {visit.day: visit for visit in rows.visits}
    for record in undecided(database, block, tag_id):
        assert record.day is not None  # it is of a visit
        visit = by_day.get(record.day, CountedVisit(tag_id, record.day, (), 0, 0))
        pictures = (*visit.pictures, _as_counted(database, record))
        by_day[record.day] = replace(visit, pictures=pictures)
    visits = [by_day[day] for day in sorted(by_day)]
    return _with_words(database, tag_id, visits, rows.tag_size_mm)


def undecided(database: Database, block: EntryId, tag_id: int) -> tuple[CaptureRecord, ...]:
    """Each visit's last picture of a cluster, where it was read and waits for a decision."""
    last = {record.visit: record for record in cluster_history(database, block, tag_id)}
    return tuple(
        record
        for record in last.values()
        if record.action is None
        and record.reading is not None
        and record.reading.status is not Status.RETAKE
    )


def block_rows(database: Database, block: EntryId) -> tuple[ClusterRows, ...]:
    """All clusters of a block of which something was accepted or marked, by tag."""
    visits, size_mm = counted_visits(database, block), tag_size_mm(database, block)
    return tuple(
        _with_words(database, tag_id, tuple(counted), size_mm)
        for tag_id, counted in groupby(visits, key=lambda visit: visit.tag_id)
    )


def followed_cluster(database: Database, rows: ClusterRows) -> FollowedCluster:
    """With its readings: they take room, so that a block is not to be held as a whole."""
    return FollowedCluster(
        rows.tag_id,
        tuple(_visit(database, visit, rows.tag_size_mm) for visit in rows.visits),
        tuple(_word(row) for row in rows.words),
    )


def tracks_of(
    cluster: FollowedCluster,
    method: Association = Association.GEOMETRY,
    size_rule: SizeRule | None = None,
) -> tuple[Track, ...]:
    """The cluster's fruitlets over its visits; the size rule is the method's where none is named.

    Takes some 10 to 100 ms, and scipy, which screens load only in a thread of their own.
    """
    from fieldcam.growth.tracking import track

    return track(cluster.visits, method, cluster.words, size_rule)


def word_row(word: MatchWord) -> AssociationWord:
    """The row that keeps the operator's word."""
    if word.other is not None:
        other, fruitlet = word.other.reading, word.other.fruitlet
        return AssociationWord(word.one.reading, word.one.fruitlet, other, fruitlet)
    assert word.not_in is not None  # a word names the other fruitlet or where there is none
    return AssociationWord(word.one.reading, word.one.fruitlet, word.not_in)


def _with_words(
    database: Database, tag_id: int, visits: Sequence[CountedVisit], size_mm: float
) -> ClusterRows:
    readings = [picture.reading for visit in visits for picture in visit.pictures]
    return ClusterRows(tag_id, tuple(visits), association_words(database, readings), size_mm)


def _visit(database: Database, visit: CountedVisit, size_mm: float) -> ClusterVisit:
    views = tuple(_view(database, picture, size_mm) for picture in visit.pictures)
    said = {
        answer: frozenset(
            Place(word.reading, word.fruitlet) for word in visit.told if word.answer is answer
        )
        for answer in Answer
    }
    return ClusterVisit(
        visit.day, views, visit.fallen, visit.hidden, said[Answer.FALLEN], said[Answer.HIDDEN]
    )


def _view(database: Database, picture: CountedPicture, size_mm: float) -> View:
    return View(
        picture.reading,
        _with_cards_of(stored_reading(database, picture.reading), size_mm),
        picture.struck_out,
        picture.fallen,
        picture.cluster,
    )


def _as_counted(database: Database, record: CaptureRecord) -> CountedPicture:
    assert record.reading is not None  # it was read
    marked = {
        kind: frozenset(seen.id for seen in record.reading.fruitlets if kind in seen.marks)
        for kind in (MarkKind.NOT_A_FRUITLET, MarkKind.FALLEN)
    }
    return CountedPicture(
        capture=record.id,
        reading=record.reading.id,
        cluster=corrected_target(database, record.reading.id),
        living=record.reading.living,
        area_px=0,
        struck_out=marked[MarkKind.NOT_A_FRUITLET],
        fallen=marked[MarkKind.FALLEN],
    )


def _with_cards_of(reading: ClusterReading, size_mm: float) -> ClusterReading:
    """A card is as far away as it is large: it may have been read as one of another size."""
    tag, factor = reading.tag, size_mm / reading.settings.tag_size_mm
    if factor == 1 or tag is None or tag.translation_mm is None:
        return reading
    x, y, z = tag.translation_mm
    moved = replace(tag, translation_mm=(x * factor, y * factor, z * factor))
    return replace(reading, tag=moved)


def _word(row: AssociationWord) -> MatchWord:
    one = Place(row.one_reading, row.one_fruitlet)
    if row.other_fruitlet is None:
        return MatchWord(one, None, row.other_reading)
    return MatchWord(one, Place(row.other_reading, row.other_fruitlet))
