"""The undo key: takes back the operator's newest command as a whole.

On the walk that is any command; on a cluster's own screens one about its fruitlets.
"""

from __future__ import annotations

from collections.abc import Sequence

from fieldcam.session.deciding.here import stand_at
from fieldcam.session.doubt import NotNow
from fieldcam.session.viewing import WalkView
from fieldcam.store.connection import rows
from fieldcam.store.queries.blocks import last_set_up
from fieldcam.store.queries.lookups import row_of
from fieldcam.store.queries.resuming import Undoable, last_undoable, undoable_words
from fieldcam.store.rows.fruit import AssociationWord, CaliperIdentity, CaliperSize
from fieldcam.store.rows.judgements import FruitletMark, MarkKind, Undo
from fieldcam.store.rows.kinds import KIND_OF, WORDS
from fieldcam.store.rows.row import EntryId, Row
from fieldcam.store.store import Store

_SAME_MOMENT = (
    "FROM (SELECT here.* FROM standing AS here JOIN entry AS last"
    " ON last.device = here.device AND last.boot = here.boot"
    " AND last.boot_ns = here.boot_ns AND last.at_utc = here.at_utc"
    " WHERE last.id = ?) AS written"
)
"""The standing rows of one command share the moment at which they were written."""


def undo_last(view: WalkView) -> str:
    """Undo, and stand where the operator can see what changed."""
    store = view.store
    last = last_undoable(store.database, store.identity.device, view.visit)
    if last is None:
        raise NotNow("There is nothing to undo.")
    named, tag_id = _undo(store, last.id), _tag(store, last)
    if tag_id is None:
        return f"Undone: {named}."
    stand_at(view, tag_id)
    return f"Undone: {named} on tag {tag_id}."


def undo_match(view: WalkView, tag_id: int) -> str:
    """Undo the last match that was said of this cluster on this visit."""
    return _undo_of_cluster(view, tag_id, (AssociationWord,), "match")


def undo_fruit(view: WalkView, tag_id: int) -> str:
    """Undo the last name, size or king that this cluster's fruitlets got on this visit."""
    kinds = (CaliperSize, CaliperIdentity, FruitletMark)
    return _undo_of_cluster(view, tag_id, kinds, "size, name or king")


def _undo_of_cluster(view: WalkView, tag_id: int, kinds: Sequence[type[Row]], what: str) -> str:
    """`what` says which words these are, where none is left."""
    store = view.store
    words = undoable_words(store.database, store.identity.device, view.visit, kinds)
    fruit = (word for word in words if word.kind is not FruitletMark or _on_cluster(store, word))
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
    sql = f"SELECT {WORDS[word.kind].tag} AS tag_id FROM {word.kind.table} AS word WHERE id = ?"
    tag_id: int | None = rows(store.database, sql, word.id)[0]["tag_id"]
    return tag_id


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
    return " and ".join(dict.fromkeys(together.values()))


def _struck_out_with(store: Store, entry: EntryId) -> list[EntryId]:
    """What a command had taken back itself counts again."""
    found = rows(store.database, f"SELECT undo.target {_SAME_MOMENT} JOIN undo USING (id)", entry)
    return [row["target"] for row in found]


def _written_together(store: Store, entry: EntryId) -> dict[EntryId, str]:
    """Those that can be undone, as the operator knows them, the earliest first."""
    sql = f"SELECT written.id, written.kind {_SAME_MOMENT} ORDER BY written.seq"
    found = {row["id"]: KIND_OF[row["kind"]].named for row in rows(store.database, sql, entry)}
    return {each: named for each, named in found.items() if named}
