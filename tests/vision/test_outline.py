"""Outlines of drawn masks: where they run, which part is the fruitlet's own, what fits them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from fieldcam.values import BoolMask, FloatMap, Instance, Mask, Region
from fieldcam.vision.sizing.ellipse import EllipseFit, fit_ellipse
from fieldcam.vision.sizing.outline import (
    Cover,
    hidden_arc,
    pixel_outline,
    true_edge,
    zero_outline,
)

Vectors = npt.NDArray[np.float64]
SIDE = 120
ROWS, COLUMNS = np.mgrid[0:SIDE, 0:SIDE].astype(np.float64)


def ellipse_distance(
    minor_px: float, ratio: float, angle_rad: float, center: tuple[float, float]
) -> Vectors:
    """Distance (px) inside an ellipse, to first order."""
    along = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    across = np.array([-along[1], along[0]])
    shape = 2 / minor_px * (np.outer(along, along) / ratio + np.outer(across, across))
    mapped = (np.stack([COLUMNS, ROWS], axis=-1) - center) @ shape
    radius = np.maximum(np.linalg.norm(mapped, axis=-1), 1e-9)
    steep = np.linalg.norm(mapped @ shape, axis=-1) / radius
    return np.asarray((1 - radius) / np.maximum(steep, 1e-9), dtype=np.float64)


def seen(inside: Vectors, covered: Vectors | None = None) -> Instance:
    """What a perfect network says about a silhouette, and a cover (positive inside it)."""
    visible = inside if covered is None else np.minimum(inside, -covered)
    logits = np.tanh(visible / 4).astype(np.float32) * 6
    whole = np.tanh(inside / 4).astype(np.float32) * 6
    return Instance((0, 0, SIDE, SIDE), 1.0, Mask(0, 0, logits > 0), logits, whole)


def fitted(instance: Instance, cover: Cover | None = None, whole: bool = True) -> EllipseFit:
    outline = zero_outline(instance.visible_logits, 0, 0)
    silhouette = instance.whole_logits if whole else None
    own = true_edge(outline, instance, cover, silhouette)
    hidden = np.zeros((0, 2))
    if silhouette is not None:
        hidden = hidden_arc(outline, zero_outline(silhouette, 0, 0))
    fit = fit_ellipse(outline.points_px[own], hidden)
    assert fit is not None
    return fit


def random_ellipses(count: int, seed: int = 0) -> list[tuple[float, Vectors]]:
    rng = np.random.default_rng(seed)
    drawn = []
    for _ in range(count):
        minor = rng.uniform(20, 60)
        center = (SIDE / 2 + rng.uniform(-1, 1), SIDE / 2 + rng.uniform(-1, 1))
        inside = ellipse_distance(minor, rng.uniform(1, 1.2), rng.uniform(0, np.pi), center)
        drawn.append((minor, inside))
    return drawn


def test_the_zero_line_is_found_to_a_fraction_of_a_pixel() -> None:
    inside = ellipse_distance(41.3, 1.0, 0.0, (60.4, 59.7))
    outline = zero_outline(seen(inside).visible_logits, 1000, 500)
    offset = outline.points_px - (1060.4, 559.7)
    assert np.abs(np.linalg.norm(offset, axis=1) - 41.3 / 2).max() < 0.05
    outward = offset / np.linalg.norm(offset, axis=1, keepdims=True)
    assert (outward * outline.outward).sum(axis=1).min() > 0.99


@pytest.mark.parametrize(
    ("estimate", "bias", "spread"),
    [("contour", -0.9, 0.15), ("default", 0.0, 0.12)],
)
def test_width_of_unoccluded_masks(estimate: str, bias: float, spread: float) -> None:
    import cv2

    errors = []
    for minor, inside in random_ellipses(40):
        instance = seen(inside)
        if estimate == "contour":
            points = pixel_outline(instance.visible).astype(np.float32)
            errors.append(min(cv2.fitEllipse(points)[1]) - minor)
        else:
            errors.append(fitted(instance).ellipse.minor_px - minor)
    assert np.mean(errors) == pytest.approx(bias, abs=0.1)
    assert np.std(errors) < spread


def half_plane(inside: Vectors, share: float, angle_rad: float) -> Vectors:
    """Distance inside a straight cover that hides this share of a silhouette."""
    along = COLUMNS * np.cos(angle_rad) + ROWS * np.sin(angle_rad)
    edge = np.quantile(along[inside > 0], 1 - share)
    return np.asarray(along - edge, dtype=np.float64)


@pytest.mark.parametrize(("share", "limit_px"), [(0.1, 0.8), (0.2, 0.8), (0.4, 1.6)])
def test_a_cover_hardly_changes_the_width(share: float, limit_px: float) -> None:
    rng = np.random.default_rng(5)
    errors = []
    for minor, inside in random_ellipses(30, seed=1):
        covered = half_plane(inside, share, rng.uniform(0, 2 * np.pi))
        errors.append(fitted(seen(inside, covered)).ellipse.minor_px - minor)
    assert abs(np.mean(errors)) < 0.2
    assert np.quantile(np.abs(errors), 0.9) < limit_px


def test_the_stated_uncertainty_grows_with_the_cover_and_bounds_the_error() -> None:
    stated, errors = [], []
    for share in (0.02, 0.3, 0.6):
        fits = [
            (minor, fitted(seen(inside, half_plane(inside, share, 0.7))))
            for minor, inside in random_ellipses(15, seed=2)
        ]
        stated.append(np.mean([fit.minor_sd_px for _, fit in fits]))
        errors += [abs(f.ellipse.minor_px - minor) / f.minor_sd_px for minor, f in fits]
    assert stated[0] < stated[1] < stated[2]
    assert np.quantile(errors, 0.95) < 2.5


def test_edges_made_by_a_cover_are_told_from_the_fruitlets_own() -> None:
    inside = ellipse_distance(50, 1.1, 0.3, (60, 60))
    covered = half_plane(inside, 0.3, 0.0)
    instance = seen(inside, covered)
    outline = zero_outline(instance.visible_logits, 0, 0)
    own = true_edge(outline, instance, None, instance.whole_logits)
    columns = np.rint(outline.points_px).astype(int)
    on_cover = inside[columns[:, 1], columns[:, 0]] > 4
    assert not own[on_cover].any()
    assert own[~on_cover].mean() > 0.8


def blocked_region(blocked: BoolMask) -> Cover:
    return Cover(Region(0, 0, SIDE, SIDE), blocked)


def test_without_a_whole_silhouette_something_nearer_marks_the_cover() -> None:
    minor = 50.0
    inside = ellipse_distance(minor, 1.05, 0.3, (60, 60))
    covered = half_plane(inside, 0.25, 0.0)
    instance = seen(inside, covered)
    blind = fitted(instance, whole=False).ellipse.minor_px
    informed = fitted(instance, blocked_region(covered > 0), whole=False).ellipse.minor_px
    assert abs(informed - minor) < 1.5
    assert abs(blind - minor) > 2 * abs(informed - minor)


def test_a_dent_is_not_the_fruitlets_own_edge() -> None:
    inside = ellipse_distance(50, 1.0, 0.0, (60, 60))
    twig = 4.0 - np.abs(COLUMNS - 60.0)
    twig[ROWS > 60] = -50.0
    fit = fitted(seen(inside, twig), whole=False)
    assert fit.ellipse.minor_px == pytest.approx(50.0, abs=0.5)


def test_a_silhouette_cut_in_two_by_a_twig_is_still_one_fruitlet() -> None:
    inside = ellipse_distance(50, 1.0, 0.0, (60, 60))
    twig = 3.0 - np.abs(COLUMNS - 63.0)
    assert fitted(seen(inside, twig)).ellipse.minor_px == pytest.approx(50.0, abs=0.5)


def test_specks_do_not_enter_the_outline() -> None:
    inside = ellipse_distance(40, 1.0, 0.0, (60, 60))
    speck = ellipse_distance(4, 1.0, 0.0, (20, 20))
    outline = zero_outline(seen(np.maximum(inside, speck)).visible_logits, 0, 0)
    assert np.linalg.norm(outline.points_px - (60, 60), axis=1).max() < 21


EMPTY: FloatMap = np.full((20, 20), -1, np.float32)


@pytest.mark.parametrize("points", [0, 3, 5])
def test_too_few_points_give_no_fit(points: int) -> None:
    edge = np.random.default_rng(0).uniform(0, 40, (points, 2))
    assert fit_ellipse(edge, np.zeros((0, 2))) is None
    assert len(zero_outline(EMPTY, 0, 0).points_px) == 0
    assert pixel_outline(Mask(0, 0, EMPTY > 0)).shape == (0, 2)


def test_stray_points_do_not_move_the_fit() -> None:
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    edge = np.stack([60 + 22 * np.cos(angle), 50 + 20 * np.sin(angle)], axis=1)
    stray = edge.copy()
    stray[:30] += 6.0
    fit = fit_ellipse(stray, np.zeros((0, 2)))
    assert fit is not None
    assert fit.ellipse.minor_px == pytest.approx(40.0, abs=0.4)
    assert fit.center_px == pytest.approx((60.0, 50.0), abs=0.4)
