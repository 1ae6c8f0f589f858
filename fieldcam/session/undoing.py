"""The undo key: takes back the operator's newest command as a whole.

On the walk that is any command; on a cluster's own screens one about its fruitlets.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldcam.session.doubt import NotNow
from fieldcam.store.connection import rows
from fieldcam.store.queries.blocks import last_set_up
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.queries.resuming import Undoable, last_undoable, undoable_words
from fieldcam.store.rows import EntryId
from fieldcam.store.rows.judgements import MarkKind, Undo
from fieldcam.store.store import Store

_TAG = {
    "decision": "SELECT capture_now.tag_id FROM capture_now JOIN decision AS word"
    " ON word.capture = capture_now.id WHERE word.id = ?",
    "tag_correction": "SELECT capture_now.tag_id FROM capture_now JOIN tag_correction AS word"
    " ON word.capture = capture_now.id WHERE word.id = ?",
    "target_correction": "SELECT capture_now.tag_id FROM capture_now JOIN target_correction AS word"
    " ON word.reading = capture_now.reading WHERE word.id = ?",
    "note": "SELECT capture_now.tag_id FROM capture_now JOIN note AS word"
    " ON word.subject = capture_now.id WHERE word.id = ?",
    "skip": "SELECT tag_id FROM skip WHERE id = ?",
    "fruitlet_mark": "SELECT coalesce(word.tag_id, (SELECT capture_now.tag_id FROM capture_now"
    " WHERE capture_now.reading = word.reading)) AS tag_id"
    " FROM fruitlet_mark AS word WHERE word.id = ?",
    "caliper_size": "SELECT tag_id FROM caliper_size WHERE id = ?",
    "caliper_identity": "SELECT capture_now.tag_id FROM capture_now JOIN caliper_identity AS word"
    " ON word.reading = capture_now.reading WHERE word.id = ?",
    "association_word": "SELECT capture_now.tag_id FROM capture_now JOIN association_word AS word"
    " ON word.one_reading = capture_now.reading WHERE word.id = ?",
}
"""Which cluster a row is about, by its table."""
_NAMES = {
    "decision": "the decision",
    "tag_correction": "the tag's correction",
    "target_correction": "the choice of the target",
    "note": "the note",
    "skip": "the skipping",
    "fruitlet_mark": "the mark",
    "caliper_size": "the caliper size",
    "caliper_identity": "the fruit's name",
    "association_word": "the match",
    "missing_word": "the answer",
    "block_facts": "the block's facts",
    "tree": "the trees",
    "cluster": "the place on the route",
    "route": "the route",
    "block_setting": "the number",
    "spray": "the spray",
    "visit_day": "the visit's day",
}


_SAME_MOMENT = (
    "FROM (SELECT here.* FROM standing AS here JOIN entry AS last"
    " ON last.device = here.device AND last.boot = here.boot"
    " AND last.boot_ns = here.boot_ns AND last.at_utc = here.at_utc"
    " WHERE last.id = ?) AS written"
)
"""The standing rows of one command share the moment at which they were written."""


def undo_last(store: Store, visit: EntryId) -> tuple[str, int | None]:
    """Undo; gives what was undone and the tag that it was about."""
    last = last_undoable(store.database, store.identity.device, visit)
    if last is None:
        raise NotNow("There is nothing to undo.")
    kinds, tag_id = _undo(store, last.id), _tag(store, last)
    return f"Undone: {kinds}{'' if tag_id is None else f' on tag {tag_id}'}.", tag_id


def undo_match(store: Store, visit: EntryId, tag_id: int) -> str:
    """Undo the last match that was said of this cluster on this visit."""
    return _undo_of_cluster(store, visit, tag_id, ("association_word",), "match")


def undo_fruit(store: Store, visit: EntryId, tag_id: int) -> str:
    """Undo the last name, size or king that this cluster's fruitlets got on this visit."""
    kinds = ("caliper_size", "caliper_identity", "fruitlet_mark")
    return _undo_of_cluster(store, visit, tag_id, kinds, "size, name or king")


def _undo_of_cluster(
    store: Store, visit: EntryId, tag_id: int, kinds: Sequence[str], what: str
) -> str:
    """`what` says which words these are, where none is left."""
    words = undoable_words(store.database, store.identity.device, visit, kinds)
    fruit = (word for word in words if word.kind != "fruitlet_mark" or _on_cluster(store, word))
    last = next((word for word in fruit if _tag(store, word) == tag_id), None)
    if last is None:
        raise NotNow(
            f"No {what} of tag {tag_id} is left to undo here; decisions are undone on Walk."
        )
    return f"Undone: {_undo(store, last.id)} on tag {tag_id}."


def undo_last_set_up(store: Store, block: EntryId) -> str:
    """Undo the last change of how a block is set up; gives what was undone."""
    last = last_set_up(store.database, store.identity.device, block)
    if last is None:
        raise NotNow("There is nothing to undo.")
    return f"Undone: {_undo(store, last)}."


def _tag(store: Store, word: Undoable) -> int | None:
    """The cluster that a word is about."""
    found = rows(store.database, _TAG[word.kind], word.id)
    return found[0]["tag_id"] if found else None


def _on_cluster(store: Store, mark: Undoable) -> bool:
    """Whether the mark is one of the Cluster screen; all others are decisions of the walk."""
    kind = row_of(store.database, "fruitlet_mark", mark.id)["mark"]
    return kind in (MarkKind.KING, MarkKind.ADDED_BY_HAND)


def _undo(store: Store, entry: EntryId) -> str:
    """Take back what was written together with a row; gives its names."""
    together, struck_out = _written_together(store, entry), _struck_out_with(store, entry)
    store.append(
        *(Undo(each) for each in together),
        *(Undo(each, undone=False) for each in struck_out),
    )
    return " and ".join(dict.fromkeys(_NAMES[kind] for kind in together.values()))


def _struck_out_with(store: Store, entry: EntryId) -> list[EntryId]:
    """What a command had taken back itself counts again."""
    found = rows(store.database, f"SELECT undo.target {_SAME_MOMENT} JOIN undo USING (id)", entry)
    return [row["target"] for row in found]


def _written_together(store: Store, entry: EntryId) -> dict[EntryId, str]:
    """Those that can be undone, the earliest first."""
    sql = f"SELECT written.id, written.kind {_SAME_MOMENT} ORDER BY written.seq"
    return {
        row["id"]: row["kind"] for row in rows(store.database, sql, entry) if row["kind"] in _NAMES
    }
