"""The yardstick of the segmentation on photographs measures what it says."""

from __future__ import annotations

import pytest
from box_scores import Box, BoxScore, box_iou, score_boxes, total, yolo_boxes

SQUARE: Box = (0, 0, 10, 10)


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (SQUARE, 1.0),
        ((0, 0, 10, 5), 0.5),
        ((5, 0, 15, 10), 1 / 3),
        ((5, 5, 15, 15), 25 / 175),
        ((10, 0, 20, 10), 0.0),
        ((30, 30, 40, 40), 0.0),
    ],
)
def test_iou_is_shared_over_joined_area(other: Box, expected: float) -> None:
    assert box_iou(SQUARE, other) == pytest.approx(expected)
    assert box_iou(other, SQUARE) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("found", "true", "expected"),
    [
        ([], [], BoxScore(0, 0, 0)),
        ([SQUARE], [], BoxScore(1, 0, 0)),
        ([], [SQUARE], BoxScore(0, 1, 0)),
        ([SQUARE], [SQUARE], BoxScore(1, 1, 1)),
        # A second box on the same fruit is wrong.
        ([SQUARE, (0, 0, 10, 9)], [SQUARE], BoxScore(2, 1, 1)),
        # The first takes its best match and leaves the other to the second.
        ([(0, 0, 10, 9), (0, 0, 10, 6)], [(0, 0, 10, 6), SQUARE], BoxScore(2, 2, 2)),
        ([(0, 0, 10, 4.9)], [SQUARE], BoxScore(1, 1, 0)),
        ([(0, 0, 10, 5)], [SQUARE], BoxScore(1, 1, 1)),
    ],
)
def test_each_true_box_is_matched_once(
    found: list[Box], true: list[Box], expected: BoxScore
) -> None:
    assert score_boxes(found, true) == expected


def test_precision_and_recall_are_of_all_pictures_together() -> None:
    score = total([BoxScore(1, 4, 1), BoxScore(9, 4, 3)])
    assert (score.precision, score.recall) == (0.4, 0.5)
    assert (BoxScore(0, 3, 0).precision, BoxScore(0, 3, 0).recall) == (1.0, 0.0)
    assert (BoxScore(3, 0, 0).precision, BoxScore(3, 0, 0).recall) == (0.0, 1.0)


def test_yolo_lines_become_boxes_in_pixels() -> None:
    assert yolo_boxes("0 0.5 0.25 0.2 0.1\n", (200, 100)) == [pytest.approx((80, 20, 120, 30))]
    assert yolo_boxes("", (200, 100)) == []
