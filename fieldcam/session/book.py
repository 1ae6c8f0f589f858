"""The operator's decisions, as rows: what each key writes, and when it is refused.

Every method gives the sentence that tells the operator what was done, or raises
NotNow or Doubtful before anything was written.
"""

from __future__ import annotations

from dataclasses import dataclass

from fieldcam.growth.places import Place
from fieldcam.session.deciding.learning import new_cluster, tree_after
from fieldcam.session.doubt import Doubtful, NotNow
from fieldcam.session.left_over import left_over
from fieldcam.session.shutter import Shot
from fieldcam.session.state import Shown, Stage, missing
from fieldcam.session.viewing import WalkView, expected_at, is_learning
from fieldcam.store.queries.blocks import trees
from fieldcam.store.queries.counted import missing_words
from fieldcam.store.queries.history import CaptureRecord, ReadingSummary, capture_record
from fieldcam.store.queries.walks import OPEN_STATES, ClusterState
from fieldcam.store.rows import EntryId, Row
from fieldcam.store.rows.fruit import MissingWord
from fieldcam.store.rows.judgements import (
    Action,
    Answer,
    Decision,
    FruitletMark,
    MarkKind,
    Note,
    Skip,
    TagCorrection,
    TargetCorrection,
)
from fieldcam.store.rows.walk import Event, EventKind
from fieldcam.values import HIGHEST_TAG_ID, Expectation, Status
from fieldcam.words import number_of

MOST_MM = 100.0
"""No apple in its first weeks is larger."""
MOST_FRUITLETS = 20
"""No cluster carries more."""
MARKS = {Answer.FALLEN: MarkKind.FALLEN, Answer.HIDDEN: MarkKind.HIDDEN}


@dataclass(frozen=True, slots=True)
class WalkBook:
    """Decisions about one visit; used by one thread."""

    view: WalkView

    def shot(self, insist: bool = False) -> Shot:
        """The picture that is due here."""
        (tag_id, tree), route = self.view.place(), self.view.route()
        shown = self.view.shown(tag_id, route)
        if tag_id is None:
            return self._shot_of_any_tag(shown, tree, insist)
        stop = route.stop(tag_id)
        if stop is not None and stop.state is ClusterState.ACCEPTED and not insist:
            raise Doubtful(f"Tag {tag_id} is done already. Take it again?")
        expected = self.view.expectation(tag_id)
        if shown is None:
            return Shot(expected, tree=tree)
        return Shot(expected, shown.record.view, retake_of=shown.id, tree=tree)

    def _shot_of_any_tag(self, shown: Shown | None, tree: EntryId | None, insist: bool) -> Shot:
        """Which cluster it is will be read; it takes the place of a picture that shows no tag."""
        if not insist and not self._learning:
            raise Doubtful(f"{self._nothing_due()} Take one that the route does not have?")
        again = shown is not None and shown.stage is not Stage.ANALYSING
        replaced = shown.id if shown is not None and again else None
        return Shot(Expectation(), retake_of=replaced, tree=tree)

    def second_view(self) -> Shot:
        """A picture of the same cluster from another side, beside the last one."""
        shown, tag_id = self._shown(), self._standing()
        expected, (_, tree) = self.view.expectation(tag_id), self.view.place()
        return Shot(expected, shown.record.view + 1, tree=tree)

    def accept(self, insist: bool = False) -> str:
        """The picture counts; on to the next cluster."""
        tag_id, shown = self._standing(), self._shown()
        if shown.record.action is Action.ACCEPT:
            raise NotNow("This picture is accepted already.")
        self._check_tag(shown)
        if self._missing(shown):
            raise NotNow("Fewer fruitlets than last visit: F fallen, H hidden, or R retake.")
        if not insist and shown.status is Status.RETAKE:
            raise Doubtful("The verdict is RETAKE. Keep this picture all the same?")
        if not insist and shown.stage is not Stage.READ:
            raise Doubtful("There is no verdict on this picture. Keep it all the same?")
        self.view.store.append(Decision(shown.id, Action.ACCEPT))
        self._move_on(tag_id)
        return f"Tag {tag_id} accepted."

    def answer(self, answer: Answer) -> str:
        """The answer to CONFIRM's question; without one, a mark on one that no picture shows."""
        tag_id, shown = self._standing(), self._shown()
        if self._missing(shown):
            return self._answered(answer, tag_id, shown)
        self._check_room(answer, tag_id, shown)
        self.view.store.append(FruitletMark.on_cluster(MARKS[answer], self.view.visit, tag_id))
        return f"One fruitlet of tag {tag_id} marked {answer}."

    def tell_missing(self, capture: EntryId, place: Place | None, answer: Answer) -> str:
        """One answer for one fruitlet that a picture of any visit does not show.

        `place` is where an earlier picture shows it; None where that has no depth. With the
        last one the picture counts.
        """
        database = self.view.store.database
        record, visit, tag_id = self._open_question(capture)
        words = missing_words(database, visit, tag_id)
        if place in {Place(word.reading, word.fruitlet) for word in words}:
            raise NotNow("That was told already: U on Walk takes the last answer back.")
        marks = self.view.marks(tag_id, visit)
        left = self._left_to_tell(record, visit, tag_id) - 1
        if left < 0:
            raise NotNow("No fruitlet is missing: F and H are for those that no picture shows.")
        rows: list[Row] = [FruitletMark.on_cluster(MARKS[answer], visit, tag_id)]
        if place is not None:
            rows.insert(0, MissingWord(visit, tag_id, place.reading, place.fruitlet, answer))
        if left:
            self.view.store.append(*rows)
            return f"Told: {answer}. {number_of(left, 'fruitlet')} left to tell."
        alike = all(mark.mark is MARKS[answer] for mark in marks)
        self.view.store.append(Decision(capture, Action.ACCEPT, answer if alike else None), *rows)
        if visit == self.view.visit:
            self._move_on(tag_id)
        return f"Tag {tag_id} accepted: all that is missing is told."

    def accept_picture(self, capture: EntryId) -> str:
        """A picture of any visit counts, where nothing is left to tell of it."""
        record, visit, tag_id = self._open_question(capture)
        if record.reading is None or record.reading.status is Status.RETAKE:
            raise NotNow("There are no sizes to accept: the verdict is RETAKE, or there is none.")
        if left := self._left_to_tell(record, visit, tag_id):
            fruitlets = number_of(left, "fruitlet")
            raise NotNow(f"{fruitlets} missing: T compares the days, F or H there answers.")
        self.view.store.append(Decision(capture, Action.ACCEPT))
        if visit == self.view.visit:
            self._move_on(tag_id)
        return f"Tag {tag_id} accepted."

    def retake(self) -> str:
        """The picture does not count; the cluster waits for another one."""
        shown = self._shown()
        self.view.store.append(Decision(shown.id, Action.RETAKE))
        tag_id = self.view.standing()
        return "Take it again." if tag_id is None else f"Tag {tag_id}: take it again."

    def correct_tag(self, tag_id: int, insist: bool = False) -> str:
        """The picture shows this tag, whatever was read."""
        shown, route = self._shown(), self.view.route()
        if tag_id > HIGHEST_TAG_ID:
            raise NotNow(f"There is no tag {tag_id}: they end at {HIGHEST_TAG_ID}.")
        stop = route.stop(tag_id)
        done = stop is not None and stop.state is ClusterState.ACCEPTED
        if not insist and done and shown.record.tag_id != tag_id:
            raise Doubtful(f"Tag {tag_id} is done already. Is this another picture of it?")
        if not insist and stop is None and route.planned:
            raise Doubtful(f"Tag {tag_id} is not on this route. Does it hang in this tree?")
        new = (new_cluster(self.view, shown.id, tag_id),) if stop is None else ()
        self.view.store.append(TagCorrection(shown.id, tag_id), *new)
        self._stand_at(tag_id)
        return f"The picture is of tag {tag_id}."

    def other_target(self) -> str:
        """The next cluster of the picture is the tagged one."""
        shown = self._shown()
        if shown.reading is None or shown.record.reading is None:
            raise NotNow("There is no reading to choose a cluster in.")
        found = sorted({f.cluster for f in shown.reading.fruitlets if f.cluster is not None})
        if len(found) < 2:
            raise NotNow("Only one cluster was found in this picture.")
        ids = {fruitlet.id for fruitlet in shown.target}
        now = next((f.cluster for f in shown.reading.fruitlets if f.id in ids), None)
        chosen = found[(found.index(now) + 1) % len(found)] if now in found else found[0]
        self.view.store.append(TargetCorrection(shown.record.reading.id, chosen))
        return f"Target is cluster {found.index(chosen) + 1} of {len(found)}."

    def strike(self, fruitlet: int) -> str:
        """This is no fruitlet."""
        shown = self._shown()
        seen = next((s for s in shown.target if s.id == fruitlet), None)
        if shown.record.reading is None or seen is None:
            raise NotNow("Choose a fruitlet of the list first.")
        if not seen.living:
            gone = "marked fallen" if MarkKind.FALLEN in seen.marks else "struck out"
            raise NotNow(f"Already {gone}.")
        reading = shown.record.reading.id
        self.view.store.append(FruitletMark.on_fruitlet(MarkKind.NOT_A_FRUITLET, reading, fruitlet))
        return "Struck out: no fruitlet."

    def king(self, capture: EntryId, fruitlet: int) -> str:
        """This fruitlet of any picture is the cluster's king; the last word counts."""
        reading = self._reading(capture)
        if not any(f.id == fruitlet and f.in_target and f.living for f in reading.fruitlets):
            raise NotNow("Choose a fruitlet of the list first.")
        self.view.store.append(FruitletMark.on_fruitlet(MarkKind.KING, reading.id, fruitlet))
        return f"Fruitlet {reading.letter(fruitlet)} is the king."

    def add_by_hand(self, capture: EntryId, diameter_mm: float) -> str:
        """A fruitlet that the picture's reading does not have, measured by hand."""
        reading = self._reading(capture)
        if not 0 < diameter_mm <= MOST_MM:
            raise NotNow(f"A fruitlet measures between 0 and {MOST_MM:g} mm.")
        mark = FruitletMark(MarkKind.ADDED_BY_HAND, reading=reading.id, diameter_mm=diameter_mm)
        self.view.store.append(mark)
        return f"Added by hand: {diameter_mm:.2f} mm."

    def note(self, text: str) -> str:
        """A note on the picture; without one, on the visit."""
        if not text.strip():
            raise NotNow("The note is empty.")
        tag_id = self.view.standing()
        shown = self.view.shown(tag_id, self.view.route())
        subject = self.view.visit if shown is None else shown.id
        self.view.store.append(Note(text.strip(), subject))
        return "Noted."

    def skip(self) -> str:
        """Leave this cluster out today."""
        tag_id = self._standing()
        self.view.store.append(Skip(self.view.visit, tag_id))
        self._move_on(tag_id)
        return f"Tag {tag_id} skipped."

    def go_to(self, tag_id: int) -> str:
        """Stand at another cluster."""
        stop = self.view.route().stop(tag_id)
        if stop is None:
            raise NotNow(f"Tag {tag_id} is not on this route.")
        self._stand_at(tag_id)
        done = ", which is done already" if stop.state is ClusterState.ACCEPTED else ""
        return f"At tag {tag_id}{done}."

    def step(self, by: int) -> str:
        """Stand at the route's next or previous cluster, whatever its state."""
        tags = [stop.tag_id for stop in self.view.route().stops]
        if not tags:
            raise NotNow("This block has no clusters yet.")
        here = self.view.standing()
        if here not in tags:
            return self.go_to(tags[0 if by > 0 else -1])
        return self.go_to(tags[(tags.index(here) + by) % len(tags)])

    def next_tree(self) -> str:
        """On to the next tree: to its first cluster that needs a picture, or to learn it."""
        tree = tree_after(self.view)
        route, visit = self.view.route(), self.view.visit
        stops = [stop for stop in route.stops if stop.tree == tree]
        due = [stop for stop in stops if stop.state in OPEN_STATES]
        tag_id = next((stop.tag_id for stop in due or stops), None)
        self.view.store.append(Event(EventKind.WENT_TO, visit, tag_id=tag_id, tree=tree))
        label = trees(self.view.store.database, route.block)[tree]
        return f"Tree {label}." if stops else f"Tree {label}: each tag you take joins the route."

    def stand_where_undone(self, tag_id: int | None) -> None:
        """Where the operator can see what an undo changed."""
        if tag_id is not None:
            self._stand_at(tag_id)

    def _standing(self) -> int:
        tag_id = self.view.standing()
        if tag_id is not None:
            return tag_id
        if self.view.shown(None, self.view.route()) is not None:
            raise NotNow("Which tag this picture shows is not known yet: T says it, R retakes.")
        if self._learning:
            raise NotNow("Take a picture first: its tag joins the route.")
        raise NotNow(f"{self._nothing_due()} Choose one on the route to go back to it.")

    def _nothing_due(self) -> str:
        return left_over(self.view.route()) or "All clusters are done."

    def _shown(self) -> Shown:
        shown = self.view.shown(self.view.standing(), self.view.route())
        if shown is None:
            raise NotNow("There is no picture of this cluster yet.")
        return shown

    @property
    def _learning(self) -> bool:
        return is_learning(self.view.route(), self.view.place()[1])

    def _reading(self, capture: EntryId) -> ReadingSummary:
        record = capture_record(self.view.store.database, capture)
        if record is None or record.reading is None:
            raise NotNow("This picture has no reading.")
        return record.reading

    def _missing(self, shown: Shown) -> int:
        return missing(shown.record, self.view.expectation(self._standing()).fruitlets)

    def _open_question(self, capture: EntryId) -> tuple[CaptureRecord, EntryId, int]:
        """A picture that is not decided on, its visit and its tag."""
        record = capture_record(self.view.store.database, capture)
        if record is None or record.visit is None or record.tag_id is None:
            raise NotNow("Which cluster this picture shows is not known yet.")
        if record.action is not None:
            raise NotNow("This picture is decided on already: U on Walk takes that back.")
        return record, record.visit, record.tag_id

    def _left_to_tell(self, record: CaptureRecord, visit: EntryId, tag_id: int) -> int:
        """How many of its missing fruitlets wait for an answer."""
        before = expected_at(self.view.store.database, visit, tag_id).fruitlets
        told = sum(mark.count for mark in self.view.marks(tag_id, visit))
        return max(0, missing(record, before) - told)

    def _answered(self, answer: Answer, tag_id: int, shown: Shown) -> str:
        """The picture counts, and so many fruitlets as were not marked before."""
        self._check_tag(shown)
        missing = self._missing(shown)
        before = min(missing, self._marked(tag_id))
        rows: list[Row] = [Decision(shown.id, Action.ACCEPT, answer)]
        if missing > before:
            # Last, so that an undo after a restart takes it back first.
            kind, visit = MARKS[answer], self.view.visit
            rows.append(FruitletMark.on_cluster(kind, visit, tag_id, missing - before))
        self.view.store.append(*rows)
        self._move_on(tag_id)
        known = f" ({before} of them marked before)" if before else ""
        return f"Tag {tag_id} accepted, {missing} {answer}{known}."

    def _marked(self, tag_id: int) -> int:
        """Fruitlets of this cluster that were said to be fallen or hidden today."""
        return sum(mark.count for mark in self.view.marks(tag_id))

    def _check_room(self, answer: Answer, tag_id: int, shown: Shown) -> None:
        """No more are fallen or hidden than the cluster had; what a picture shows is neither."""
        before, marked = self.view.expectation(tag_id).fruitlets, self._marked(tag_id)
        if before is None and answer is Answer.FALLEN:
            raise NotNow("No earlier visit is known here: nothing can have fallen since.")
        known = marked + (shown.living or 0)
        if known < (MOST_FRUITLETS if before is None else before):
            return
        if marked:
            had = f"of the {before} last visit" if before is not None else "of a cluster"
            raise NotNow(f"No more: {known} {had} are seen or marked already.")
        raise NotNow("No fruitlet is missing: F and H are for those that no picture shows.")

    def _check_tag(self, shown: Shown) -> None:
        read, due = shown.wrong_tag, shown.record.tag_id
        if read is not None:
            raise NotNow(f"Tag {read} was read, {due} is due: R retakes, T says which it is.")

    def _move_on(self, tag_id: int) -> None:
        """To the next cluster that needs a picture, unless the rows say so already."""
        if self.view.standing() == tag_id:
            self._stand_at(self.view.route().next_tag(tag_id))

    def _stand_at(self, tag_id: int | None) -> None:
        if self.view.standing() != tag_id:
            went = Event(EventKind.WENT_TO, self.view.visit, tag_id=tag_id)
            self.view.store.append(went)
