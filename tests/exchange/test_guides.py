"""The tables that the guide shows are read as it says."""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import dedent

import pytest

from fieldcam.exchange.calipers.reading import read_calipers
from fieldcam.exchange.route_table import read_route
from fieldcam.growth.records import Presence

GUIDE = Path(__file__).resolve().parents[2] / "docs/tables.md"


def shown(heading: str) -> str:
    """The block of the guide that begins with this line."""
    block = re.search(rf"^    {re.escape(heading)}\n(?:    .*\n)*", GUIDE.read_text(), re.MULTILINE)
    assert block is not None
    return dedent(block[0])


@pytest.mark.parametrize(
    "heading",
    ["date,cluster,fruit,diameter_mm", "tree,cluster,fruit,diam.2026-05-10,diam.2026-05-14"],
)
def test_the_caliper_tables_of_the_guide(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "gala.csv"
    path.write_text(shown(heading))
    first, second = read_calipers(path).record.fruitlets
    assert [each.diameter_mm for each in first.sightings.values()] == [8.5, 11.0]
    assert [each.presence for each in second.sightings.values()][-1] is Presence.FALLEN


def test_the_route_of_the_guide(tmp_path: Path) -> None:
    path = tmp_path / "route.csv"
    path.write_text(shown("row,tree,tag"))
    assert [(each.tree, each.tag_id) for each in read_route(path).stops] == [
        ("1-1", 17),
        ("1-2", 18),
        ("2-1", 19),
    ]
