"""The overlay picture shows what the reading says, on any image."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_readings import TAG, grey_image, made_fruitlet, made_reading

from fieldcam.report.ink import Canvas, Rect, Typeface
from fieldcam.report.labels import PlacedLabel, Wish, place_labels
from fieldcam.report.overlay import STATUS_COLOURS, TARGET, draw_overlay
from fieldcam.values import (
    ClusterReading,
    Expectation,
    Flag,
    ImageU8,
    Reason,
    ReasonCode,
    Status,
    Verdict,
)

NOTE = "Trained on rendered fruit."
ZOOM = 2.25
"""The test images are 640 pixels wide, the picture is 1440."""


def overlay(reading: ClusterReading, image: ImageU8 | None = None) -> ImageU8:
    return draw_overlay(grey_image() if image is None else image, reading, False, NOTE)


def close_to(picture: ImageU8, colour: tuple[int, int, int], tolerance: int = 30) -> int:
    """How many pixels have about this colour."""
    difference = np.abs(picture.astype(int) - colour).max(axis=-1)
    return int((difference <= tolerance).sum())


CLUSTER = [made_fruitlet(i, (290.0 + 24 * i, 220.0 + 9 * (i % 2))) for i in range(4)]


def test_the_image_given_is_left_alone() -> None:
    image = grey_image()
    overlay(made_reading(CLUSTER), image)
    assert (image == 90).all()


def test_target_outlines_are_drawn_and_the_rest_is_dimmed() -> None:
    picture = overlay(made_reading(CLUSTER))
    x, y = (round((v + 0.5) * ZOOM) for v in CLUSTER[0].center_px)
    ring = picture[y - 24 : y + 25, x - 24 : x + 25]
    assert close_to(ring, TARGET) > 40
    assert picture[200, 1300].max() < 70
    assert overlay(made_reading())[200, 1300].max() == 90


@pytest.mark.parametrize(
    ("code", "drawn"), [(ReasonCode.UNSURE_FRUIT, True), (ReasonCode.FEWER_THAN_BEFORE, False)]
)
def test_places_that_the_verdict_asks_about_are_ringed(code: ReasonCode, drawn: bool) -> None:
    verdict = Verdict(Status.CONFIRM, (Reason(code, "2 places may be fruit."),))
    plain = made_reading(CLUSTER, verdict)
    asked = replace(plain, unsure_px=((480.0, 300.0),))
    changed = (overlay(asked) != overlay(plain)).any(axis=-1)
    x, y = round(480.5 * ZOOM), round(300.5 * ZOOM)
    assert changed[y - 20 : y + 21, x - 20 : x + 21].any() == drawn
    assert changed.sum() < 2000


@pytest.mark.parametrize("status", list(Status))
def test_the_verdict_has_its_colour(status: Status) -> None:
    reason = Reason(ReasonCode.TOO_DARK, "The picture is too dark.")
    picture = overlay(made_reading(CLUSTER, Verdict(status, (reason,))))
    for each, colour in STATUS_COLOURS.items():
        found = close_to(picture[:60, :160], colour, 3)
        assert (found > 800) == (each is status)


def test_a_fruitlet_without_a_size_is_drawn_dashed() -> None:
    sized = overlay(made_reading([made_fruitlet(0, (300.0, 220.0))], tag=None))
    hidden = made_fruitlet(0, (300.0, 220.0), None, flags=(Flag.HIDDEN,))
    dashed = overlay(made_reading([hidden], tag=None))
    window = np.s_[470:525, 650:705]
    assert 0 < close_to(dashed[window], TARGET, 60) < close_to(sized[window], TARGET, 60) / 2


@pytest.mark.parametrize(
    "shape", [(48, 64, 3), (480, 640, 3), (480, 640), (1080, 1440, 3), (900, 1800, 3)]
)
def test_any_image_size_is_drawn_on(shape: tuple[int, ...]) -> None:
    picture = overlay(made_reading(CLUSTER), np.full(shape, 90, np.uint8))
    assert picture.shape[1] == max(1440, shape[1])
    assert picture.dtype == np.uint8


def test_things_beyond_the_border_are_drawn_as_far_as_they_reach() -> None:
    places = [(-3.0, 200.0), (638.0, 479.0), (-90.0, 200.0), (300.0, 900.0)]
    outside = [made_fruitlet(i, place, None) for i, place in enumerate(places)]
    outside += [made_fruitlet(4 + i, place) for i, place in enumerate(places)]
    assert overlay(made_reading(outside)).shape == (1080, 1440, 3)


def test_many_fruitlets_and_long_reasons_fit() -> None:
    crowd = [
        made_fruitlet(
            i, (40.0 + 60 * (i % 10), 80.0 + 60 * (i // 10)), in_target=i < 7, cluster=i // 6
        )
        for i in range(60)
    ]
    reasons = tuple(Reason(ReasonCode.BLURRED, "A sentence that goes on. " * 5) for _ in range(4))
    reading = made_reading(crowd, Verdict(Status.RETAKE, reasons), TAG, Expectation(17, 9))
    assert overlay(reading).shape == (1080, 1440, 3)


def shared_px(a: Rect, b: Rect) -> float:
    width, height = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
    return max(0.0, width) * max(0.0, height)


def wish(x: float, y: float, outwards: tuple[float, float] = (0.0, 0.0)) -> Wish:
    return Wish((x, y), 20.0, outwards, 90.0, 30.0, (14.0, 30.0, 60.0, 90.0))


def around(fruits: list[tuple[float, float]]) -> tuple[list[PlacedLabel], list[Rect]]:
    discs = [Rect(x - 20, y - 20, x + 20, y + 20) for x, y in fruits]
    wishes = [wish(x, y, (x - 300, y - 300)) for x, y in fruits]
    return place_labels(wishes, Rect(0, 0, 600, 600), discs), discs


def test_labels_cover_neither_each_other_nor_a_fruit() -> None:
    placed, discs = around([(280, 290), (325, 280), (300, 325), (340, 330), (260, 335), (300, 250)])
    rects = [p.rect for p in placed]
    for i, rect in enumerate(rects):
        assert all(shared_px(rect, other) == 0 for other in rects[:i])
        assert all(shared_px(rect, disc) == 0 for disc in discs)


def test_labels_stay_inside_the_frame() -> None:
    placed, _ = around([(22, 22), (578, 22), (22, 578), (578, 578)])
    for place in placed:
        assert 0 <= place.rect.x0 < place.rect.x1 <= 600
        assert 0 <= place.rect.y0 < place.rect.y1 <= 600


def test_a_leader_ends_at_its_label() -> None:
    placed, _ = around([(300, 300)])
    (_, (x, y)) = placed[0].leader
    assert placed[0].rect.grown(0.01).x0 <= x <= placed[0].rect.grown(0.01).x1
    assert placed[0].rect.grown(0.01).y0 <= y <= placed[0].rect.grown(0.01).y1


def test_text_has_ink_where_it_should_and_none_beyond() -> None:
    canvas, face = Canvas(grey_image(0)), Typeface(30, bold=True)
    canvas.text((100, 200), "9.13 mm", face, (255, 255, 255))
    rows, columns = np.nonzero(canvas.image[..., 0] > 128)
    assert columns.min() >= 95 and columns.max() <= 105 + face.width_px("9.13 mm")
    assert abs(rows.max() - 200) <= 3
    assert abs((rows.max() - rows.min()) - face.cap_height_px) <= 4
