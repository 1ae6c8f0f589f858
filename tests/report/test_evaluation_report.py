"""The evaluation as a page, a document and a table."""

from __future__ import annotations

import csv
import io
import json
import sys
from dataclasses import replace
from typing import Any

import pytest
from checked_pages import words_of
from made_evaluation import caliper_block, caliper_fruit, day, named_cluster

from fieldcam.errors import ExtraMissing
from fieldcam.exchange.evaluation_report import CSV_COLUMNS, evaluation_csv, evaluation_report
from fieldcam.growth.evaluation.evaluating import Evaluation, score_readings, seconds_of
from fieldcam.growth.records import BlockRecord, SizeSource
from fieldcam.report.evaluation_page import evaluation_page


def persist_pct(block: BlockRecord) -> float:
    return 40.0 if block.source is SizeSource.CALIPERS else 42.5


def evaluated(name: str = "North", simulated: bool = False) -> Evaluation:
    cluster = named_cluster(17, {0: [[9.0, 8.0, 7.5, None]], 4: [[12.0, 9.0, 9.5, 8.0]]}, "abc?")
    table = [("a", 9.1, 12.1), ("b", 8.1, 9.1), ("c", 7.6, 9.6), ("z", 6.0, None)]
    calipers = caliper_block(
        [caliper_fruit(17, fruit, {0: one, 4: other}) for fruit, one, other in table]
    )
    readings = score_readings("RAFT-Stereo", [cluster], calipers, persist_pct)
    timed = seconds_of([4.0, 6.0])
    assert timed is not None
    return Evaluation(
        name, persist_pct(calipers), (readings,), {"at the cluster": timed}, simulated
    )


FOUND = evaluated()
NOTHING = Evaluation("North", None, ())
NOBODY_NAMED = replace(
    FOUND,
    readings=(
        score_readings("RAFT-Stereo", [named_cluster(17, {0: [[9.0]]}, "?")],
                       caliper_block([]), lambda _: None),
    ),
)  # fmt: skip


def document() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(json.dumps(evaluation_report(FOUND), allow_nan=False))
    return found


def test_the_document_holds_both_tables_and_every_pair() -> None:
    found = document()
    (readings,) = found["readings"]
    assert found["calipers"] == {"persist_pct": 40.0, "abscise_pct": 60.0}
    assert list(readings["sizes"]) == [str(day(0)), str(day(4)), "all"]
    assert readings["sizes"]["all"]["measured"] == 7
    assert readings["sizes"]["all"]["bias_mm"] == pytest.approx(-0.1)
    assert readings["known_association"]["aapd_pct"] == 2.5
    assert [each["method"] for each in readings["end_to_end"]] == [
        "geometry",
        "paper",
        "size-order",
    ]
    assert readings["end_to_end"][0]["association"]["recall_pct"] == 100.0
    assert len(readings["pairs"]) == 7
    assert readings["only_by_calipers"] == [{"date": str(day(0)), "tag": 17, "fruit": "z"}]
    assert readings["unnamed"] == 2
    assert found["seconds_per_cluster"]["at the cluster"]["times_faster_than_calipers"] == 6.0


def test_the_table_repeats_the_document_row_by_row() -> None:
    rows = list(csv.DictReader(io.StringIO(evaluation_csv(FOUND))))
    assert tuple(rows[0]) == CSV_COLUMNS
    values = {
        (r["source"], r["day"], r["association"], r["measure"]): float(r["value"]) for r in rows
    }
    sizes = document()["readings"][0]["sizes"]
    for on, figures in sizes.items():
        # Three sizes say nothing of limits.
        assert figures.pop("limits95_mm") is None
        for measure, value in figures.items():
            assert values["RAFT-Stereo", on, "", measure] == value
        assert ("RAFT-Stereo", on, "", "limits95_mm") not in values
    assert values["RAFT-Stereo", "", "geometry", "association_precision_pct"] == 100.0
    assert values["RAFT-Stereo", "", "known", "aapd_pct"] == 2.5
    assert values["at the cluster", "", "", "median_s"] == 5.0


@pytest.fixture(scope="module")
def page() -> str:
    return evaluation_page([FOUND])


def test_the_page_has_the_figures_in_words(page: str) -> None:
    text = words_of(page)
    assert "6 sizes compared, mean absolute error 0.10 mm, bias \N{MINUS SIGN}0.10 mm" in text
    assert "differ by 2.5 points" in text
    assert "tag 17: z" in text
    assert "Simulated" not in text


def test_names_cannot_break_a_page_and_simulated_data_are_marked() -> None:
    name = '<b>Gala & "Fuji"</b> ' + "x" * 200
    text = words_of(evaluation_page([evaluated(name, simulated=True)]))
    assert name in text and "Simulated data" in text


@pytest.mark.parametrize("found", [[NOTHING], [NOBODY_NAMED, NOTHING]])
def test_little_to_say_still_makes_a_page(found: list[Evaluation]) -> None:
    text = words_of(evaluation_page(found))
    assert "so that nothing can be said" in text or "no pictures" in text
    for each in found:
        json.dumps(evaluation_report(each), allow_nan=False)
        assert evaluation_csv(each).startswith("block,")


def test_equal_data_give_equal_pages(page: str) -> None:
    assert evaluation_page([evaluated()]) == page


def test_without_matplotlib_one_sentence_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ExtraMissing, match=r"matplotlib.*fieldcam\[report\]"):
        evaluation_page([FOUND])
