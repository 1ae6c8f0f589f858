"""What crosses the pipe arrives unchanged, in whatever pieces; anything else is refused."""

from __future__ import annotations

import json
import os
import struct
from dataclasses import replace
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_readings import TAG, made_fruitlet, made_reading

from fieldcam import errors
from fieldcam.analysis.messages import (
    LONGEST_BYTES,
    Analyse,
    FindTags,
    Frames,
    MessageInvalid,
    Ping,
    Request,
    Setup,
    WarmUp,
    decode_reply,
    encode_reply,
    encode_request,
    frame,
    requests_in,
)
from fieldcam.analysis.supervisor import RestartWindow
from fieldcam.codec.readings import EncodedReading, dump_reading
from fieldcam.errors import AnalysisFailed, FieldcamError, ImageUnreadable
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Calibration, Expectation, Matcher, Method, Settings

lengths = st.floats(0.1, 1e5)
counts = st.none() | st.integers(0, 10_000)
# File names are bytes; what is no UTF-8 in them comes as lone surrogates.
paths = st.text(
    st.characters(exclude_characters="\0", exclude_categories=[]), min_size=1, max_size=20
).map(Path)
calibrations = st.builds(
    Calibration, st.integers(1, 9999), st.integers(1, 9999), lengths, lengths, lengths, lengths
)
settings = st.builds(
    Settings,
    st.sampled_from(Method),
    st.sampled_from(Matcher),
    st.booleans(),
    lengths,
)
requests = st.one_of(
    st.builds(
        WarmUp, st.builds(Setup, st.none() | calibrations | paths, settings, st.none() | paths)
    ),
    st.builds(
        Analyse,
        st.builds(SavedCapture, st.text(), paths, paths, paths, st.none() | paths),
        st.builds(Expectation, counts, counts),
    ),
    st.builds(FindTags, paths, st.integers(1, 9), st.none() | paths),
    st.just(Ping()),
)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)  # fmt: skip


@given(st.lists(requests, max_size=3))
def test_requests_arrive_as_they_were_sent(sent: list[Request]) -> None:
    stream = b"".join(map(encode_request, sent))
    assert list(requests_in(BytesIO(stream))) == sent
    assert list(requests_in(BytesIO(stream[:-1]))) == sent[:-1]


@given(
    st.lists(st.binary(min_size=1, max_size=99), max_size=5),
    st.lists(st.integers(0, 200), max_size=20),
)
def test_documents_come_whole_out_of_any_pieces(documents: list[bytes], cuts: list[int]) -> None:
    stream = b"".join(frame(document) for document in documents)
    edges = [0, *sorted(cut for cut in cuts if cut < len(stream)), len(stream)]
    frames = Frames()
    arrived = []
    for start, end in pairwise(edges):
        arrived += list(frames.feed(stream[start:end]))
    assert arrived == documents


@given(st.binary(max_size=300))
def test_fuzz_any_bytes_are_waited_for_or_refused(data: bytes) -> None:
    try:
        for document in Frames().feed(data):
            decode_reply(document)
    except MessageInvalid:
        pass


@given(json_values.map(lambda value: json.dumps(value).encode()) | st.binary(max_size=50))
def test_a_document_that_is_no_reply_is_refused(document: bytes) -> None:
    with pytest.raises(MessageInvalid):
        decode_reply(document)


@pytest.mark.parametrize("reading", [None, 1, [], {}, {"schema": 1}, {"schema": 99}])
def test_a_reading_that_is_none_is_refused(reading: object) -> None:
    with pytest.raises(MessageInvalid):
        decode_reply(json.dumps({"is": "reading", "reading": reading}).encode())


@pytest.mark.parametrize("length", [0, LONGEST_BYTES + 1, 2**32 - 1])
def test_a_length_that_no_reading_has_is_refused_at_once(length: int) -> None:
    with pytest.raises(MessageInvalid):
        list(Frames().feed(struct.pack(">I", length)))


def test_not_a_number_does_not_travel() -> None:
    nan = float("nan")
    for answer in (
        made_reading([made_fruitlet(0, (100.0, 100.0), nan)]),
        (replace(TAG, decision_margin=nan),),
    ):
        with pytest.raises(ValueError):
            encode_reply(answer)


def test_a_reading_arrives_as_the_text_that_is_stored() -> None:
    reading = made_reading([made_fruitlet(0, (100.0, 100.0))], expectation=Expectation(17, 5))
    (document,) = Frames().feed(frame(encode_reply(reading)))
    reply = decode_reply(document)
    assert isinstance(reply, EncodedReading)
    assert reply.text == dump_reading(reading) == dump_reading(reply.decode())


def leaves(kind: type[FieldcamError]) -> list[type[FieldcamError]]:
    return [kind, *(leaf for child in kind.__subclasses__() for leaf in leaves(child))]


@pytest.mark.parametrize(
    "kind", [kind for kind in leaves(FieldcamError) if kind.__module__ == errors.__name__]
)
def test_each_error_of_ours_arrives_as_itself(kind: type[FieldcamError]) -> None:
    error = decode_reply(encode_reply(kind("It is so.", "Do this.")))
    assert type(error) is kind
    assert (error.message, error.hint) == ("It is so.", "Do this.")


@pytest.mark.parametrize("name", ["SystemExit", "ExitCode", "IntEnum", "no such thing"])
def test_an_error_of_nobodys_arrives_as_a_failed_analysis(name: str) -> None:
    document = {"is": "error", "error": name, "message": "m", "hint": "h"}
    assert type(decode_reply(json.dumps(document).encode())) is AnalysisFailed


@pytest.mark.parametrize("name", [os.fsdecode(b"caf\xe9.yml"), "caf\ud800.yml"])
def test_an_error_may_name_what_is_no_text(name: str) -> None:
    error = decode_reply(encode_reply(ImageUnreadable(f"{name} is damaged.")))
    assert isinstance(error, ImageUnreadable)
    assert error.message == "caf?.yml is damaged."


def test_done_is_done() -> None:
    assert decode_reply(encode_reply(None)) is None


@given(st.lists(st.floats(0, 30), max_size=60), st.integers(0, 6), st.floats(1, 100))
def test_no_span_ever_holds_more_restarts_than_allowed(
    pauses_s: list[float], limit: int, span_s: float
) -> None:
    now_s = 0.0
    window = RestartWindow(limit, span_s, lambda: now_s)
    allowed: list[float] = []
    for pause_s in pauses_s:
        now_s += pause_s
        room = sum(now_s - then < span_s for then in allowed) < limit
        assert window.allow() is room
        if room:
            allowed.append(now_s)
