"""Figures of boxes against boxes, on cases that can be counted by hand."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from export import detection_quality as quality

pytestmark = pytest.mark.export

TRUTH = torch.tensor([[0.0, 0, 10, 10], [20, 0, 30, 10], [40, 0, 50, 10]])


def _found(*marks: tuple[float, bool]) -> list[quality.Found]:
    return [quality.Found(score, right) for score, right in marks]


def test_a_fruit_is_found_once() -> None:
    boxes = torch.tensor([[1.0, 0, 11, 10], [0, 0, 10, 10], [21, 0, 31, 10], [60, 0, 70, 10]])
    found = quality.match(boxes, torch.tensor([0.9, 0.8, 0.7, 0.6]), TRUTH)
    assert [f.right for f in found] == [True, False, True, False]


def test_without_fruit_nothing_is_right() -> None:
    found = quality.match(TRUTH, torch.tensor([0.9, 0.8, 0.7]), TRUTH[:0])
    assert [f.right for f in found] == [False] * 3


@pytest.mark.parametrize(
    ("found", "total", "expected"),
    [
        (_found((0.9, True), (0.8, True)), 2, 1.0),
        (_found((0.9, True), (0.8, False), (0.7, True)), 2, (1 + 2 / 3) / 2),
        (_found((0.9, False), (0.8, True)), 1, 0.5),
        # A later rise of precision lifts what came before it.
        (_found((0.9, True), (0.8, False), (0.7, True), (0.6, True)), 3, (1 + 0.75 + 0.75) / 3),
        (_found((0.9, True)), 4, 0.25),
        ([], 3, 0.0),
        (_found((0.9, False)), 0, 0.0),
    ],
)
def test_average_precision(found: list[quality.Found], total: int, expected: float) -> None:
    assert quality.average_precision(found, total) == pytest.approx(expected)


def test_average_precision_does_not_depend_on_the_order() -> None:
    rng = np.random.default_rng(2)
    found = _found(*((float(s), bool(s > rng.random())) for s in rng.random(30)))
    shuffled = [found[i] for i in rng.permutation(30)]
    assert quality.average_precision(found, 20) == quality.average_precision(shuffled, 20)
