"""What written dates mean: decided by all dates of a file together, never by one alone.

5/10/2026 may be the fifth of October or the tenth of May; 5/14/2026 beside it says which.
Where two readings remain, both are said, and nothing is guessed.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import date, timedelta
from enum import StrEnum

from fieldcam.errors import BadInput


class Order(StrEnum):
    """In which order numbers say a date."""

    DAY_FIRST = "the day first"
    MONTH_FIRST = "the month first"
    YEAR_FIRST = "the year first"
    """Of two digits; one of four digits needs no guessing."""


@dataclass(frozen=True, slots=True)
class WrittenDate:
    """A date as it stands in a table."""

    text: str
    place: str
    typed: bool = True
    """False for a cell that a spreadsheet program took for a date itself."""


@dataclass(frozen=True, slots=True)
class Calendar:
    """What the dates of a file mean."""

    days: Mapping[str, date]
    """By what is written."""
    notes: tuple[str, ...]
    """What was assumed, a sentence each."""


_CLOCK = r"\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?: ?[ap]\.?m\.?)?"
_ZONE = r"z|(?:utc|gmt)?[+-]\d{1,2}(?::?\d{2})?|utc|gmt"
_TIME = re.compile(rf"(?:t| |, )({_CLOCK}) ?({_ZONE})?$")
"""Behind a date, as spreadsheets, ODK and Field Book write it."""
_UTC = re.compile(r"z|(?:utc|gmt)(?:[+-]0{1,2}(?::?00)?)?|[+-]0{1,2}(?::?00)?")
_WEEKDAY = re.compile(r"^(?:mon|tue|wed|thu|fri|sat|sun)[a-z]*\.?,? ")
_ISO = re.compile(r"(\d{4})([-./])(\d{1,2})\2(\d{1,2})")
_COMPACT = re.compile(r"((?:19|20)\d{2})(\d{2})(\d{2})")
_NUMBERS = re.compile(r"(\d{1,2})([-./ ])(\d{1,2})\2(\d{4}|\d{2})")
_NAME = r"([a-z]{3,10})\.?"
_YEAR = r"(\d{4}|\d{2})"
_NAMED_DAY_FIRST = re.compile(rf"(\d{{1,2}})(?:\.|st|nd|rd|th)?[-/ ]?{_NAME},?[-/ ]?{_YEAR}")
_NAMED_MONTH_FIRST = re.compile(rf"{_NAME}[-/ ]?(\d{{1,2}})(?:st|nd|rd|th)?,?[-/ ]{_YEAR}")
_NO_YEAR = re.compile(
    rf"\d{{1,2}}[-./ ]+{_NAME}|{_NAME}[-/ ]+\d{{1,2}}|\d{{1,2}}(?:/\d{{1,2}}|\.\d{{1,2}}\.)"
)
_SERIAL = re.compile(r"\d{5}(?:\.\d+)?")
_FIRST_SERIAL, _LAST_SERIAL = 36526, 73050
"""2000-01-01 and 2099-12-31, in days since the end of 1899."""
_SPREADSHEETS_BEGIN = date(1899, 12, 30)
_MONTHS = {
    name: month
    for month, names in enumerate(
        (
            "jan ene gen",
            "feb fev",
            "mar mrz",
            "apr abr avr",
            "may mai mag",
            "jun giu juin",
            "jul lug juil",
            "aug ago aou",
            "sep set",
            "oct okt ott out",
            "nov",
            "dec dez dic",
        ),
        start=1,
    )
    for name in names.split()
}
"""As English, German, French, Spanish, Italian and Portuguese begin them, without accents."""
_ONE_SEASON = timedelta(days=366)
HOW_TO_WRITE = "Write dates as 2026-05-21."
Readings = Mapping[Order, date]


def is_day(text: str) -> bool:
    """Whether it is written like a date, be there such a day or not."""
    written = _plain(text)
    forms = (_ISO, _COMPACT, _NUMBERS)
    return (
        any(form.fullmatch(written) for form in forms) or bool(_readings(text)) or _lacks_year(text)
    )


def calendar_of(written: Iterable[WrittenDate]) -> Calendar:
    """What each date means; raises BadInput for what is none, and where two readings remain."""
    first: dict[str, WrittenDate] = {}
    for each in written:
        first.setdefault(each.text, each)
    read = {text: _readings(text) for text in first}
    for text, readings in read.items():
        if not readings:
            raise _no_date(first[text])
    order = _order(first, read)
    days = {text: readings[order] for text, readings in read.items()}
    _refuse_swapped(first, read, days)
    return Calendar(days, tuple(_notes(read, days, order)))


def _order(first: Mapping[str, WrittenDate], read: Mapping[str, Readings]) -> Order:
    """The only one that reads all, or any where all read the same."""
    possible: Sequence[Order] = [
        order for order in Order if all(order in readings for readings in read.values())
    ]
    if not possible:
        raise _mixed(first, read)
    if any(_two_digit_year(text) for text in read):
        possible = _of_one_season(possible, read)
    for text, readings in read.items():
        if len({readings[order] for order in possible}) > 1:
            both = " or ".join(f"{readings[order]} ({order})" for order in possible)
            raise BadInput(
                f"{first[text].place}: {text!r} is {both}, and nothing beside it says which.",
                HOW_TO_WRITE,
            )
    return possible[0]


def _of_one_season(orders: Sequence[Order], read: Mapping[str, Readings]) -> Sequence[Order]:
    """With years of two digits nearly all orders read; those that spread over years do not."""
    near = [
        order
        for order in orders
        if max(each[order] for each in read.values()) - min(each[order] for each in read.values())
        < _ONE_SEASON
    ]
    return near or orders


def _mixed(first: Mapping[str, WrittenDate], read: Mapping[str, Readings]) -> BadInput:
    by_order = {
        order: next((text for text, readings in read.items() if set(readings) == {order}), None)
        for order in Order
    }
    apart = [(order, first[text]) for order, text in by_order.items() if text is not None]
    if len(apart) < 2:
        text = next(text for text, readings in read.items() if len(set(readings.values())) > 1)
        return BadInput(f"{first[text].place}: {text!r} has more than one meaning.", HOW_TO_WRITE)
    (one_order, one), (other_order, other), *_ = apart
    return BadInput(
        f"{other.place}: {other.text!r} has {other_order}, but {one.text!r} has {one_order}"
        f" ({one.place}).",
        HOW_TO_WRITE,
    )


def _refuse_swapped(
    first: Mapping[str, WrittenDate], read: Mapping[str, Readings], days: Mapping[str, date]
) -> None:
    """A program of the other order leaves as text what it cannot read, and swaps the rest."""
    taken = [text for text, each in first.items() if not each.typed]
    left = [text for text, each in first.items() if each.typed and len(read[text]) < len(Order)]
    if not taken or not left:
        return
    if all(days[text].day <= 12 for text in taken) and all(days[text].day > 12 for text in left):
        swapped = first[taken[0]]
        day = days[swapped.text]
        raise BadInput(
            f"{swapped.place}: {day} may be {day.replace(month=day.day, day=day.month)}, since"
            f" {left[0]!r} ({first[left[0]].place}) was not taken for a date: a spreadsheet"
            " program seems to have swapped day and month.",
            HOW_TO_WRITE,
        )


def _notes(read: Mapping[str, Readings], days: Mapping[str, date], order: Order) -> Iterator[str]:
    decided = [text for text, readings in read.items() if len(set(readings.values())) > 1]
    if decided:
        yield f"{decided[0]} was read as {days[decided[0]]}: all dates beside it have {order}."
    if serial := next((text for text in read if _serial(text)), None):
        yield (
            f"{serial} was read as {days[serial]}: the number of a day, as spreadsheets count them"
            " from 1900."
        )
    if utc := next((text for text in read if _UTC.fullmatch(_zone(text))), None):
        yield (
            f"{utc} is a time in UTC and was read as {days[utc]}: west of Greenwich an evening"
            " counts for the day after."
        )


def _readings(text: str) -> Readings:
    """The date in each order that gives one; the same in all where it needs no guessing."""
    written = _plain(text)
    if found := _ISO.fullmatch(written):
        return _in_any_order(found[1], found[3], found[4])
    if found := _COMPACT.fullmatch(written):
        return _in_any_order(*found.groups())
    if found := _NUMBERS.fullmatch(written):
        return _by_order(found[1], found[3], found[4], dotted=found[2] == ".")
    if found := _NAMED_DAY_FIRST.fullmatch(written):
        return _in_any_order(found[3], _month(found[2]), found[1])
    if found := _NAMED_MONTH_FIRST.fullmatch(written):
        return _in_any_order(found[3], _month(found[1]), found[2])
    if _serial(text):
        day = _SPREADSHEETS_BEGIN + timedelta(days=int(float(written)))
        return dict.fromkeys(Order, day)
    return {}


def _in_any_order(year: str, month: str, day: str) -> Readings:
    found = _day(year, month, day)
    return {} if found is None else dict.fromkeys(Order, found)


def _by_order(one: str, two: str, three: str, dotted: bool) -> Readings:
    """Between dots the day always comes first."""
    if dotted:
        return _in_any_order(three, two, one)
    found = {Order.DAY_FIRST: _day(three, two, one), Order.MONTH_FIRST: _day(three, one, two)}
    if len(three) == 2:
        found[Order.YEAR_FIRST] = _day(one, two, three)
    elif len(set(found.values())) == 1:
        found[Order.YEAR_FIRST] = found[Order.DAY_FIRST]
    return {order: day for order, day in found.items() if day is not None}


def _day(year: str, month: str, day: str) -> date | None:
    full_year = int(year) + (2000 if len(year) <= 2 else 0)
    with suppress(ValueError):
        return date(full_year, int(month), int(day))
    return None


def _plain(text: str) -> str:
    """In lower case, with spaces for underscores, without accents, weekday and time."""
    parted = unicodedata.normalize("NFKD", text.strip().lower().replace("_", " "))
    written = " ".join("".join(c for c in parted if not unicodedata.combining(c)).split())
    return _TIME.sub("", _WEEKDAY.sub("", written)).replace(" de ", " ")


def _month(name: str) -> str:
    """Its number; none of the calendar where it is no month."""
    return str(_MONTHS.get(name[:4]) or _MONTHS.get(name[:3]) or 0)


def _zone(text: str) -> str:
    found = _TIME.search(text.strip().lower())
    return (found[2] or "") if found else ""


def _serial(text: str) -> bool:
    written = text.strip()
    return bool(_SERIAL.fullmatch(written)) and (_FIRST_SERIAL <= float(written) < _LAST_SERIAL + 1)


def _lacks_year(text: str) -> bool:
    """Such as 10-May, as Excel shows what was typed as 5/10."""
    found = _NO_YEAR.fullmatch(_plain(text))
    return found is not None and all(int(_month(name)) for name in found.groups() if name)


def _two_digit_year(text: str) -> bool:
    found = _NUMBERS.fullmatch(_plain(text))
    return found is not None and len(found[4]) == 2


def _no_date(written: WrittenDate) -> BadInput:
    if _lacks_year(written.text):
        return BadInput(f"{written.place}: {written.text!r} has no year.", HOW_TO_WRITE)
    return BadInput(f"{written.place}: {written.text!r} is no date.", HOW_TO_WRITE)
