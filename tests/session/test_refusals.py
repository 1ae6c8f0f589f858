"""Why a command was not carried out, with the keys that help: only screens know keys."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import fieldcam.session
from fieldcam.session.doubt import Instead
from fieldcam.session.events import Refused
from fieldcam.tui.text.news import news

SENTENCES = {
    ("Fewer fruitlets than last visit.", Instead.ANSWER_OR_RETAKE): (
        "Fewer fruitlets than last visit: F fallen, H hidden, or R retake."
    ),
    ("No fruitlet is missing.", Instead.MARK_UNSEEN): (
        "No fruitlet is missing: F and H are for those that no picture shows."
    ),
    ("2 fruitlets missing.", Instead.COMPARE_DAYS): (
        "2 fruitlets missing: T compares the days, F or H there answers."
    ),
    ("Which tag this picture shows is not known yet.", Instead.SAY_TAG_OR_RETAKE): (
        "Which tag this picture shows is not known yet: T says it, R retakes."
    ),
    ("Tag 12 was read, 11 is due.", Instead.RETAKE_OR_SAY_TAG): (
        "Tag 12 was read, 11 is due: R retakes, T says which it is."
    ),
    ("That was told already.", Instead.UNDO_ANSWER): (
        "That was told already: U on Walk takes the last answer back."
    ),
    ("This picture is decided on already.", Instead.UNDO_DECISION): (
        "This picture is decided on already: U on Walk takes that back."
    ),
    ("Nothing says which tree these tags hang in.", Instead.GIVE_TREES): (
        "Nothing says which tree these tags hang in: Set-up (E, Route) takes it from a CSV file."
    ),
    ("The note is empty.", None): "The note is empty.",
}


@pytest.mark.parametrize("refused", SENTENCES, ids=str)
def test_a_refusal_says_which_keys_help(refused: tuple[str, Instead | None]) -> None:
    told = news(Refused(*refused))
    assert told is not None and told.bad and told.sentence == SENTENCES[refused]


def test_every_way_out_has_its_words() -> None:
    assert {instead for _, instead in SENTENCES} == {*Instead, None}


def test_no_sentence_of_the_session_names_a_key() -> None:
    folder = Path(fieldcam.session.__path__[0])
    code = "\n".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.py"))
    texts = re.sub(r'"""(?:.|\n)*?"""|#.*', "", code)
    assert re.findall(r'"[^"\n]*(?<!%)\b[B-HJ-Z]\b[^"\n]*"', texts) == []
