"""Mask windows and soft targets keep a true edge to a fraction of a cell."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from export import mask_branch
from export import segmentation_quality as quality

pytestmark = pytest.mark.export


def _disc(radius: float, centre: tuple[float, float], side: int) -> torch.Tensor:
    """(1, 1, side, side) exact-looking coverage; pixel edge coordinates."""
    zoom = 8
    axis = (np.arange(side * zoom) + 0.5) / zoom
    inside = np.hypot(axis[None] - centre[0], axis[:, None] - centre[1]) < radius
    shares = inside.reshape(side, zoom, side, zoom).mean(axis=(1, 3))
    return torch.from_numpy(shares.astype(np.float32))[None, None]


@pytest.mark.parametrize("radius", [8.0, 17.3, 35.0, 60.0])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.37, -0.21)])
def test_half_line_of_a_discs_target_is_the_disc(radius: float, shift: tuple[float, float]) -> None:
    centre = (100.0 + shift[0], 100.0 + shift[1])
    disc = _disc(radius, centre, 200)
    box = torch.tensor(
        [[centre[0] - radius, centre[1] - radius, centre[0] + radius, centre[1] + radius]]
    )
    window = mask_branch.grow_boxes(box, 1.4)
    target = mask_branch.soft_targets(disc, window, 56)[0, 0].numpy()
    logits = np.log(np.clip(target, 1e-5, 1) / np.clip(1 - target, 1e-5, 1))
    width = quality.width_of_logits(logits.astype(np.float32), window[0].numpy())
    assert width / 2 == pytest.approx(radius, abs=0.05)


def test_half_line_of_a_target_is_centred_on_the_disc() -> None:
    disc = _disc(30.0, (80.3, 91.7), 180)
    window = torch.tensor([[80.3 - 40, 91.7 - 44, 80.3 + 40, 91.7 + 44]])
    target = mask_branch.soft_targets(disc, window, 56)[0, 0].numpy()
    pasted = quality.paste((target - 0.5).astype(np.float32), window[0].numpy(), (180, 180))
    rows, columns = np.nonzero(pasted)
    assert columns.mean() + 0.5 == pytest.approx(80.3, abs=0.05)
    assert rows.mean() + 0.5 == pytest.approx(91.7, abs=0.05)


def test_each_window_gets_its_own_mask() -> None:
    masks = torch.zeros(2, 2, 40, 40)
    masks[1, 0] = 1.0
    windows = torch.tensor([[5.0, 5.0, 30.0, 30.0], [5.0, 5.0, 30.0, 30.0]])
    targets = mask_branch.soft_targets(masks, windows, 8)
    assert targets[0].max() == 0
    assert targets[1, 0].min() == pytest.approx(1.0)
    assert targets[1, 1].max() == 0


def test_cells_outside_the_image_do_not_count() -> None:
    windows = torch.tensor([[-10.0, 0.0, 10.0, 20.0]])
    inside = mask_branch.inside_weight(windows, (20, 40), 4)
    assert inside[0, 0].sum(dim=0).tolist() == [0.0, 0.0, 4.0, 4.0]
    logits = torch.zeros(1, 2, 4, 4)
    spoiled = logits.clone()
    spoiled[..., :2] = 50.0
    targets = torch.zeros(1, 2, 4, 4)
    assert mask_branch.mask_loss(spoiled, targets, inside) == mask_branch.mask_loss(
        logits, targets, inside
    )


def test_loss_without_fruitlets_is_zero() -> None:
    empty = torch.zeros(0, 2, 4, 4, requires_grad=True)
    assert float(mask_branch.mask_loss(empty, empty.detach(), torch.zeros(0, 1, 4, 4))) == 0.0
