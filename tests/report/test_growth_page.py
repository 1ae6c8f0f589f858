"""The page that a grower prints: the verdict first, and nothing broken where little is known."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from functools import cache

import cv2
import numpy as np
import pytest
from checked_pages import words_of
from made_readings import grey_image, made_fruitlet
from planned_blocks import Measuring, day_date, measured_block

from fieldcam.growth.crop import CropPlan
from fieldcam.growth.outlook import Outlook, outlook
from fieldcam.growth.records import BlockRecord, FruitletRecord, Presence, Sighting, SizeSource
from fieldcam.growth.size_order import in_size_order
from fieldcam.growth.sprays import SprayDay
from fieldcam.report.growth_page import growth_page
from fieldcam.report.growth_plots import bin_edges
from fieldcam.report.thumbnails import SIDE_PX, cluster_thumbnail
from fieldcam.simulator.plan import BlockPlan

PNG_BYTES = b"\x89PNG\r\n"


@cache
def measured() -> BlockRecord:
    block = BlockPlan.plan(seed=5, clusters=12)
    return measured_block(block, Measuring(SizeSource.CAMERA, (0, 4, 8)), 1)


def fruitlet(tag_id: int, name: str, *sizes: float | None) -> FruitletRecord:
    """Sizes on days 0 and 4; None where it has fallen."""
    seen = {
        day_date(day): Sighting(Presence.FALLEN) if mm is None else Sighting(Presence.SIZED, mm)
        for day, mm in zip((0, 4), sizes, strict=True)
    }
    return FruitletRecord(tag_id, name, seen)


def small(*fruitlets: FruitletRecord) -> Outlook:
    days = (day_date(0), day_date(4))
    tags = frozenset(f.tag_id for f in fruitlets)
    block = BlockRecord("one", SizeSource.CALIPERS, days, dict.fromkeys(days, tags), fruitlets)
    return outlook(block, in_size_order(block))


def test_the_page_says_verdict_warnings_and_what_was_assumed() -> None:
    block = measured()
    sprays = [SprayDay(date(2026, 5, 12))]
    growth = outlook(block, in_size_order(block), plan=CropPlan(100, 1), sprays=sprays)
    found, crop = growth.found, growth.crop
    assert crop is not None
    text = words_of(growth_page(growth, ["Somebody guessed."], {8: PNG_BYTES}, simulated=True))
    assert f"{crop.fruit:.0f} fruit per tree" in text
    assert "more than the target of 1: thin again" in text
    assert f"{found.set_pct:.0f} % of the first fruitlets will stay" in text
    assert all(warning.text in text for warning in growth.warnings)
    assert "Somebody guessed." in text and "Simulated data" in text
    assert "The last spray was 6 days before the second visit." in text
    assert "spray 12 May" in text and "target 1" in text
    assert f"Set if matched by size order {growth.by_size_order.set_pct:.1f} %" in text


@pytest.mark.parametrize(
    ("growth", "verdict"),
    [
        (small(fruitlet(1, "a", 8.0, 12.0)), "100 % of the first fruitlets"),
        (small(fruitlet(1, "a", 8.0, 7.5), fruitlet(1, "b", 8.0, None)), "0 % of the first"),
        (small(fruitlet(1, "a", 8.0, 8.0), fruitlet(2, "b", 9.0, 9.0)), "0 % of the first"),
    ],
    ids=["one fruitlet", "all will fall", "no growth"],
)
def test_small_blocks_have_a_page_too(growth: Outlook, verdict: str) -> None:
    text = words_of(growth_page(growth))
    assert verdict in text
    assert "There is one forecast so far" in text


@pytest.mark.parametrize(
    ("rates", "cutoff"), [([0.1, 0.4, 0.9], 0.5), ([0.2], 0.0), ([-1.0, -0.5], 0.0), ([0.0], 0.0)]
)
def test_no_bar_holds_both_sides_of_the_cutoff(rates: list[float], cutoff: float) -> None:
    edges = bin_edges(np.array(rates), cutoff)
    assert np.isclose(edges, cutoff).any()
    assert edges[0] <= min(rates) and max(rates) < edges[-1]
    assert (np.diff(edges) > 0).all()


def test_what_is_doubtful_is_marked_beside_its_sizes() -> None:
    sure, other = fruitlet(5, "1", 8.0, 10.0), fruitlet(5, "2", 8.0, 11.0)
    seen = {day: replace(each, confidence=0.53) for day, each in other.sightings.items()}
    leaf = fruitlet(6, "1", 8.0, 24.0)
    text = words_of(growth_page(small(sure, replace(other, sightings=seen), leaf)))
    assert f"2: 8.0 → 11.0 stays (doubtful: 53 % sure on {day_date(0)}; 53 % sure" in text
    assert "24.0 left out (doubtful: 4.0 mm/day to" in text
    assert "1: 8.0 → 10.0 stays" in text and "10.0 stays (" not in text


def test_a_thumbnail_shows_the_numbered_fruitlets() -> None:
    left = grey_image()
    shown = {"1": made_fruitlet(0, (300.0, 200.0)), "2": made_fruitlet(1, (340.0, 220.0))}
    picture = cv2.imdecode(np.frombuffer(cluster_thumbnail(left, shown), np.uint8), 1)
    assert picture is not None and picture.shape == (SIDE_PX, SIDE_PX, 3)
    colourful = np.ptp(picture.astype(int), axis=2) > 60
    assert colourful.any() and colourful.mean() < 0.2
    empty = cv2.imdecode(np.frombuffer(cluster_thumbnail(left[..., 0], {}), np.uint8), 1)
    assert empty is not None and np.ptp(empty) < 10
