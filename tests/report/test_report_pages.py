"""The pages of reports: nothing cut on a phone, no heading alone on paper."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from planned_blocks import Measuring, measured_block
from test_evaluation_report import FOUND

from fieldcam.growth.outlook import outlook
from fieldcam.growth.records import SizeSource
from fieldcam.growth.size_order import in_size_order
from fieldcam.report.evaluation_page import evaluation_page
from fieldcam.report.growth_page import growth_page
from fieldcam.report.page import element, figure, listing, section, table
from fieldcam.simulator.plan import BlockPlan

PHONE_PX = 390
CHROMIUM = shutil.which("chromium") or ""
MEASURED = """<script>
onload = () => {
  const page = document.querySelector("iframe").contentDocument;
  const cut = [...page.querySelectorAll("body *")].filter(each =>
    each.scrollWidth > each.clientWidth + 1 && getComputedStyle(each).overflowX == "auto"
    || each.getBoundingClientRect().right > %d + 1);
  document.title = "cut: " + cut.map(each => each.outerHTML.slice(0, 60)).join(" | ");
}
</script>"""


def growth() -> str:
    record = measured_block(BlockPlan.plan(5, 12), Measuring(SizeSource.CALIPERS, (0, 4, 8)), 1)
    return growth_page(outlook(record, in_size_order(record)))


def test_a_heading_stays_with_what_follows_it() -> None:
    rows = table(["a", "b", "c", "d"], [["1", "2", "3", "4"]], "<<<<")
    drawn = figure(element("svg", ""), "says")
    for first, kept in ((drawn, True), (element("p", "it"), True), (rows, False)):
        made = section("Sizes", first, listing(["more"]))
        start, _, rest = made.partition("</div>\n")
        assert ("<h2>Sizes</h2>" in start, first in start) == (True, kept)
        assert "more" in rest


def test_wide_tables_name_each_cell_where_a_phone_shows_it_alone() -> None:
    wide = table(["a", "b", "c", "<d>"], [["1", "2", "3", "4"]], "<<<>")
    assert 'class="wide folding"' in wide
    assert '<td class="number" data-name="&lt;d&gt;">4</td>' in wide
    assert "folding" not in table(["", ""], [["1", "2"]], "<>")


def test_one_pair_of_words_for_what_becomes_of_fruit() -> None:
    for page in (growth(), evaluation_page([FOUND])):
        words = re.sub(r"<style>.*</style>", "", page, flags=re.DOTALL)
        assert not re.search(r"persist|abscis(?!sion\))", words, re.IGNORECASE)


@pytest.mark.browser
@pytest.mark.parametrize("name", ["growth", "evaluation"])
def test_nothing_is_cut_on_a_phone(tmp_path: Path, name: str) -> None:
    page = growth() if name == "growth" else evaluation_page([FOUND])
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    frame = tmp_path / "frame.html"
    frame.write_text(
        f'<iframe src="page.html" width="{PHONE_PX}" height="4000"></iframe>{MEASURED % PHONE_PX}'
    )
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    said = subprocess.run(
        [CHROMIUM, *options, "--dump-dom", frame.as_uri()],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    ).stdout
    assert re.search(r"<title>(.*)</title>", said, re.DOTALL)
    assert "<title>cut: </title>" in said
