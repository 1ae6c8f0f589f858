"""What the certainty head is told, and that it learns it without moving the masks."""

from __future__ import annotations

import pytest
import torch

from export import certainty_head as head

pytestmark = pytest.mark.export

CELLS = 40


def _disc(axes: tuple[float, float], angle: float = 0.0) -> torch.Tensor:
    at = torch.arange(CELLS) - (CELLS - 1) / 2
    y, x = torch.meshgrid(at, at, indexing="ij")
    turn = torch.tensor(angle)
    u, v = x * turn.cos() + y * turn.sin(), y * turn.cos() - x * turn.sin()
    return torch.sigmoid((1 - torch.sqrt((2 * u / axes[0]) ** 2 + (2 * v / axes[1]) ** 2)) * 20)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.3])
@pytest.mark.parametrize("axes", [(20.0, 20.0), (26.0, 18.0)])
def test_short_axis_of_an_ellipse(axes: tuple[float, float], angle: float) -> None:
    measured = head.short_axes(_disc(axes, angle)[None])
    assert float(measured[0]) == pytest.approx(min(axes), rel=0.03)


def _case(width: float, hidden: float) -> tuple[torch.Tensor, torch.Tensor]:
    """Logits of a mask `width` cells wide, and the truth: a disc of 20 cells, some of it hidden."""
    whole = _disc((20.0, 20.0))
    visible = whole.clone()
    visible[:, : int(CELLS * hidden)] = 0
    guessed = torch.logit(_disc((width, width)), eps=1e-4)
    return torch.stack([guessed, guessed])[None], torch.stack([visible, whole])[None]


def test_the_likeliest_certainty_is_the_true_one() -> None:
    logits, targets = _case(22.0, 0.5)
    inside = torch.ones(1, 1, CELLS, CELLS)
    certainty = torch.zeros(1, 2, requires_grad=True)
    optimizer = torch.optim.Adam([certainty], lr=0.05)
    for _ in range(300):
        optimizer.zero_grad()
        loss = head.certainty_loss(certainty, logits, targets, inside)
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
    assert float(certainty[0, 0].sigmoid()) == pytest.approx(0.5, abs=0.03)
    assert float(certainty[0, 1].exp()) == pytest.approx(2**0.5 * 0.1, rel=0.1)


def test_a_fruitlet_that_the_picture_cuts_says_nothing() -> None:
    logits, targets = _case(30.0, 0.2)
    inside = torch.ones(1, 1, CELLS, CELLS)
    inside[..., 0] = 0
    assert float(head.certainty_loss(torch.zeros(1, 2), logits, targets, inside)) == 0
    empty = torch.zeros(0, 2, CELLS, CELLS)
    assert float(head.certainty_loss(torch.zeros(0, 2), empty, empty, inside[:0])) == 0


def test_it_never_moves_the_masks() -> None:
    features = torch.rand(3, 8, CELLS, CELLS, requires_grad=True)
    logits = torch.rand(3, 2, CELLS, CELLS, requires_grad=True)
    head.CertaintyHead(8)(features, logits).sum().backward()
    assert features.grad is None
    assert logits.grad is None
