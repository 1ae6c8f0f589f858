"""Carries out every command that is rows and nothing else."""

from __future__ import annotations

from typing import assert_never

from fieldcam.session import commands as c
from fieldcam.session.deciding import fruit, missing, moving, pictures, undoing
from fieldcam.session.viewing import WalkView


def decide(view: WalkView, command: c.Writing, insist: bool = False) -> str:
    """Give the sentence that tells the operator what was done.

    Raises NotNow or, unless the operator insists, Doubtful before anything was written.
    """
    match command:
        case c.Accept():
            return pictures.accept(view, insist)
        case c.Retake():
            return pictures.retake(view)
        case c.AnswerQuestion(answer):
            return missing.answer_question(view, answer)
        case c.CorrectTag(tag_id):
            return pictures.correct_tag(view, tag_id, insist)
        case c.OtherTarget():
            return pictures.other_target(view)
        case c.Strike(fruitlet):
            return pictures.strike(view, fruitlet)
        case c.AcceptPicture(capture):
            return missing.accept_picture(view, capture)
        case c.TellMissing():
            return missing.tell_missing(view, command)
        case c.CrownKing(capture, fruitlet):
            return fruit.crown_king(view, capture, fruitlet)
        case c.AddByHand(capture, diameter_mm):
            return fruit.add_by_hand(view, capture, diameter_mm)
        case c.NameFruit():
            return fruit.name_fruit(view, command, insist)
        case c.MatchFruit(word):
            return fruit.match_fruit(view, word)
        case c.WriteNote(text):
            return pictures.write_note(view, text)
        case c.SkipCluster():
            return moving.skip(view)
        case c.GoTo(tag_id):
            return moving.go_to(view, tag_id)
        case c.Step(by):
            return moving.step(view, by)
        case c.NextTree():
            return moving.next_tree(view)
        case c.UndoLast():
            return undoing.undo_last(view)
        case c.UndoMatch(tag_id):
            return undoing.undo_match(view, tag_id)
        case c.UndoFruit(tag_id):
            return undoing.undo_fruit(view, tag_id)
    assert_never(command)
