"""A stored reading comes back as it was, or is refused in one sentence."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from fieldcam.codec import packing
from fieldcam.codec.readings import dump_reading, load_reading
from fieldcam.errors import ReadingInvalid
from fieldcam.exchange.reading_report import reading_report
from fieldcam.values import (
    READING_SCHEMA_VERSION,
    Calibration,
    ClusterReading,
    DisparityWindow,
    Ellipse,
    Expectation,
    Flag,
    Fruitlet,
    Mask,
    Matcher,
    Method,
    Reason,
    ReasonCode,
    Region,
    Settings,
    Status,
    TagPose,
    Verdict,
)

NUMBERS = st.floats(-1e4, 1e4, width=32)
NUMBER_OR_NONE = st.none() | NUMBERS
WHOLE = st.integers(-3, 5000)
SHAPES = arrays.array_shapes(min_dims=2, max_dims=2, min_side=0, max_side=12)


def points(count: int) -> st.SearchStrategy[Any]:
    return st.tuples(*[NUMBERS] * count)


def clouds() -> st.SearchStrategy[npt.NDArray[np.float32]]:
    return st.integers(0, 20).flatmap(
        lambda count: arrays.arrays(np.float32, (count, 3), elements=NUMBERS)
    )


def windows() -> st.SearchStrategy[DisparityWindow]:
    known = st.floats(-50, 900, width=32) | st.just(float("nan"))
    maps = SHAPES.flatmap(lambda shape: arrays.arrays(np.float32, shape, elements=known))
    return st.builds(
        lambda x0, y0, found: DisparityWindow(
            Region(x0, y0, x0 + found.shape[1], y0 + found.shape[0]), found
        ),
        WHOLE,
        WHOLE,
        maps,
    )


TAGS = st.builds(
    TagPose,
    id=WHOLE,
    center_px=points(2),
    corners_px=st.tuples(*[points(2)] * 4),
    translation_mm=st.none() | points(3),
    rotation=st.none() | st.tuples(*[points(3)] * 3),
    decision_margin=NUMBERS,
)
FRUITLETS = st.builds(
    Fruitlet,
    id=WHOLE,
    in_target=st.booleans(),
    diameter_mm=NUMBER_OR_NONE,
    center_px=points(2),
    box_px=points(4),
    score=NUMBERS,
    disparity_px=NUMBER_OR_NONE,
    range_mm=NUMBER_OR_NONE,
    visible_fraction=NUMBERS,
    sd_mm=st.none() | NUMBERS,
    flags=st.lists(st.sampled_from(Flag), max_size=3).map(tuple),
    mask=st.builds(Mask, WHOLE, WHOLE, SHAPES.flatmap(lambda s: arrays.arrays(np.bool_, s))),
    outline=st.none() | st.builds(Ellipse, points(2), NUMBERS, NUMBERS, NUMBERS),
    cluster=st.none() | WHOLE,
    centroid_mm=st.none() | points(3),
    cloud_mm=clouds(),
)
READINGS = st.builds(
    ClusterReading,
    tag=st.none() | TAGS,
    tags_seen=st.lists(WHOLE, max_size=3).map(tuple),
    fruitlets=st.lists(FRUITLETS, max_size=3).map(tuple),
    verdict=st.builds(
        Verdict,
        st.sampled_from(Status),
        st.lists(st.builds(Reason, st.sampled_from(ReasonCode), st.text()), max_size=2).map(tuple),
    ),
    window=st.none() | windows(),
    calibration=st.builds(Calibration, WHOLE, WHOLE, NUMBERS, NUMBERS, NUMBERS, NUMBERS),
    settings=st.builds(
        Settings, st.sampled_from(Method), st.sampled_from(Matcher), st.booleans(), NUMBERS
    ),
    expectation=st.builds(Expectation, st.none() | WHOLE, st.none() | WHOLE),
    faint_px=st.lists(points(2), max_size=2).map(tuple),
    unsure_px=st.lists(points(2), max_size=2).map(tuple),
    timing_ms=st.dictionaries(st.text(), NUMBERS, max_size=2),
    models=st.dictionaries(st.text(), st.text(), max_size=2),
    software_version=st.text(),
)


def assert_same(found: object, expected: object) -> None:
    """Equal, but for the steps in which arrays are stored."""
    if isinstance(expected, np.ndarray):
        assert isinstance(found, np.ndarray)
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape)
        assert np.allclose(found, expected, rtol=1e-6, atol=0.01, equal_nan=True)
    elif hasattr(expected, "__dataclass_fields__"):
        assert type(found) is type(expected)
        for field in fields(expected):  # type: ignore[arg-type]
            assert_same(getattr(found, field.name), getattr(expected, field.name))
    elif isinstance(expected, tuple):
        assert isinstance(found, tuple) and len(found) == len(expected)
        for one, other in zip(found, expected, strict=True):
            assert_same(one, other)
    else:
        assert found == expected


@settings(max_examples=30, deadline=None)
@given(reading=READINGS)
def test_a_reading_comes_back(reading: ClusterReading) -> None:
    text = dump_reading(reading)
    assert_same(load_reading(text), reading)
    assert dump_reading(load_reading(text)) == text
    json.dumps(reading_report(reading), allow_nan=False)


def document_of(reading: ClusterReading) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(dump_reading(reading))
    return document


def read_document(document: object) -> ClusterReading:
    return load_reading(json.dumps(document))


def make_reading() -> ClusterReading:
    window = np.zeros((7, 9), np.bool_)
    window[2:6, 3:8] = True
    fruitlet = Fruitlet(
        id=0,
        in_target=True,
        diameter_mm=float(np.float32(9.1304)),
        center_px=(700.254, 500.0),
        box_px=(690.04, 490.0, 710.0, 511.0),
        score=np.float32(0.97),  # type: ignore[arg-type]
        disparity_px=233.104,
        range_mm=441.84,
        visible_fraction=0.92,
        sd_mm=0.1104,
        flags=(),
        mask=Mask(690, 490, window),
        outline=Ellipse((700.25, 500.0), 40.0, 36.0, 0.3),
        cluster=0,
        centroid_mm=(1.0, 2.0, 441.0),
        cloud_mm=np.full((5, 3), 1.25, np.float32),
    )
    hidden = replace(
        fruitlet, id=1, diameter_mm=None, sd_mm=None, outline=None, flags=(Flag.HIDDEN,)
    )
    disparity = np.linspace(180, 260, 48, dtype=np.float32).reshape(6, 8)
    disparity[2, 3] = np.nan
    return ClusterReading(
        tag=TagPose(17, (720.5, 610.25), ((0.0, 0.0),) * 4, (1.0, 2.0, 440.06), None, 60.0),
        tags_seen=(17,),
        fruitlets=(fruitlet, hidden),
        verdict=Verdict(Status.CONFIRM, (Reason(ReasonCode.FEWER_THAN_BEFORE, "2 of 3."),)),
        window=DisparityWindow(Region(600, 400, 608, 406), disparity),
        calibration=Calibration(1440, 1080, 1717.0, 719.5, 539.5, 60.0),
        settings=Settings(),
        expectation=Expectation(17, 3),
        timing_ms={"tags": 12.345, "total": 400.0},
        models={"segmentation": "ab", "stereo": "cd"},
        software_version="0.1.0",
    )


def test_the_size_document_has_the_agreed_form() -> None:
    assert json.loads(json.dumps(reading_report(make_reading()), allow_nan=False)) == {
        "tag": {"id": 17, "center_px": [720.5, 610.25], "range_mm": 440.1},
        "verdict": {
            "status": "confirm",
            "reasons": [{"code": "fewer_than_before", "text": "2 of 3."}],
        },
        "fruitlets": [
            {
                "id": 0,
                "in_target": True,
                "diameter_mm": 9.13,
                "sd_mm": 0.11,
                "center_px": [700.25, 500.0],
                "box_px": [690.0, 490.0, 710.0, 511.0],
                "score": 0.97,
                "disparity_px": 233.1,
                "range_mm": 441.8,
                "visible_fraction": 0.92,
                "flags": [],
            },
            {
                "id": 1,
                "in_target": True,
                "diameter_mm": None,
                "sd_mm": None,
                "center_px": [700.25, 500.0],
                "box_px": [690.0, 490.0, 710.0, 511.0],
                "score": 0.97,
                "disparity_px": 233.1,
                "range_mm": 441.8,
                "visible_fraction": 0.92,
                "flags": ["hidden"],
            },
        ],
        "timing_ms": {"tags": 12.3, "total": 400.0},
        "models": {"segmentation": "ab", "stereo": "cd"},
    }
    assert reading_report(replace(make_reading(), tag=None))["tag"] is None


def test_a_reading_from_before_faint_places_has_none() -> None:
    document = document_of(replace(make_reading(), faint_px=((1.0, 2.0),)))
    del document["faint_px"]
    del document["unsure_px"]
    assert read_document(document).faint_px == ()
    assert read_document(document).unsure_px == ()


def test_a_reading_from_before_uncertainties_has_none() -> None:
    document = document_of(make_reading())
    del document["fruitlets"][0]["sd_mm"]
    assert read_document(document).fruitlets[0].sd_mm is None


def test_a_newer_form_is_refused() -> None:
    document = document_of(make_reading())
    document["schema"] = READING_SCHEMA_VERSION + 1
    with pytest.raises(ReadingInvalid, match="newer fieldcam"):
        read_document(document)


@pytest.mark.parametrize(
    "document", [None, [], "x", {}, {"schema": "1"}, {"schema": True}, {"schema": 1.5}]
)
def test_what_is_no_reading_is_refused(document: object) -> None:
    with pytest.raises(ReadingInvalid, match="no stored reading"):
        read_document(document)


@pytest.mark.parametrize("text", ["", "{", "\x00", "\udcff", '{"a":' + "[" * 100_000])
def test_what_is_no_json_is_refused(text: str) -> None:
    with pytest.raises(ReadingInvalid, match="no JSON"):
        load_reading(text)


def paths(value: object, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Places of all values in a document."""
    if isinstance(value, dict):
        items: list[tuple[str | int, object]] = list(value.items())
    elif isinstance(value, list):
        items = list(enumerate(value))
    else:
        return [path]
    return [path, *(found for name, item in items for found in paths(item, (*path, name)))]


PLACES = [path for path in paths(document_of(make_reading())) if path]
ODD = [None, -1, 10**400, 1.5, float("nan"), True, "", "!", "AAAA", [], [1], {}, {"a": 1}]


def with_change(place: tuple[str | int, ...], value: object) -> dict[str, Any]:
    document = document_of(make_reading())
    parent: Any = document
    for name in place[:-1]:
        parent = parent[name]
    parent[place[-1]] = value
    return document


@given(place=st.sampled_from(PLACES), value=st.sampled_from(ODD))
def test_fuzz_a_changed_document_is_read_or_refused(
    place: tuple[str | int, ...], value: object
) -> None:
    try:
        reading = read_document(with_change(place, value))
    except ReadingInvalid as error:
        assert error.message.endswith(".")
    else:
        dump_reading(reading)


@given(place=st.integers(0, 10**6), length=st.integers(0, 40), insert=st.text(max_size=3))
def test_fuzz_damaged_text_is_read_or_refused(place: int, length: int, insert: str) -> None:
    text = dump_reading(make_reading())
    start = place % len(text)
    try:
        load_reading(text[:start] + insert + text[start + length :])
    except ReadingInvalid as error:
        assert error.message.endswith(".")


@pytest.mark.parametrize("name", [f.name for f in fields(Fruitlet) if f.name != "sd_mm"])
def test_a_missing_entry_is_refused(name: str) -> None:
    document = document_of(make_reading())
    document["fruitlets"][0].pop({"cloud_mm": "cloud"}.get(name, name))
    with pytest.raises(ReadingInvalid, match="damaged"):
        read_document(document)


def test_a_packed_map_cannot_fill_the_memory() -> None:
    document = document_of(make_reading())
    bomb = packing.encode_disparity(np.zeros((2000, 2000), np.float32))
    document["window"]["steps"] = bomb["steps"]
    with pytest.raises(ReadingInvalid, match="damaged"):
        read_document(document)


def test_disparity_is_kept_to_a_hundredth_of_a_pixel_in_little_room() -> None:
    rows, columns = np.mgrid[0:200, 0:300]
    disparity = (220 + rows / 40 + 9 * np.sin(columns / 30)).astype(np.float32)
    disparity[:20] = np.nan
    packed = packing.encode_disparity(disparity)
    found = packing.decode_disparity(
        str(packed["steps"]), 300, 200, float(packed["lowest_px"]), float(packed["steps_per_px"])
    )
    assert np.array_equal(np.isnan(found), np.isnan(disparity))
    assert np.nanmax(np.abs(found - disparity)) <= 0.01
    assert len(str(packed["steps"])) < disparity.size
