"""The tables of the ablation and the benchmark say what was measured."""

from __future__ import annotations

import pytest
from drawn_fruit import CAMERA, Fruit, draw

from export.ablation import DEFAULT, LABELS, Observed, ObservedPipeline, table, ways
from export.bench import CONTENDERS, PAPER, machine, report
from export.evaluate import Outcome
from fieldcam.values import Region
from fieldcam.vision.clouds import fruitlet_cloud
from fieldcam.vision.sizing.diameters import size_fruitlet

pytest.importorskip("embreex", reason="the simulator extra is not installed")


def outcome(name: str, errors_mm: dict[int, float]) -> Outcome:
    """A target of four fruitlets of 10 mm, some of them sized with these errors."""
    true = [
        {"diameter_mm": 10.0, "in_target": True, "visible_fraction": 0.9 if k < 3 else 0.4}
        for k in range(4)
    ]
    read = [{"diameter_mm": 10.0 + e, "in_target": True} for e in errors_mm.values()]
    report = {"fruitlets": read, "verdict": {"status": "accept"}, "timing_ms": {"total": 900.0}}
    return Outcome(name, {"fruitlets": true}, report, tuple(errors_mm))


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_the_ablations_rows_are_compared_on_what_all_of_them_size() -> None:
    rows = {
        "rough": [outcome("a", {0: 0.4, 1: -0.2, 2: 0.3}), outcome("b", {0: 0.1})],
        "fine": [outcome("a", {0: 0.1, 3: 0.5}), outcome("b", {0: 0.0})],
    }
    header, _, rough, fine = table(rows)
    assert "MAE on the 2 that every row sizes" in header
    assert cells(rough) == ["rough", "4", "0.250", "+0.150", "0.39", "0.250", "66.7%", "50.0%"]
    assert cells(fine) == ["fine", "3", "0.200", "+0.200", "0.46", "0.050", "33.3%", "37.5%"]


def test_every_correction_is_switched_on_once_and_left_out_once() -> None:
    fruits = [Fruit((0.0, 0.0, 440.0), 9.0, 1.1), Fruit((14.0, 3.0, 446.0), 11.0)]
    drawn = draw(fruits, covers=[(Region(690, 400, 720, 485), 400.0)])
    clouds = [fruitlet_cloud(i.visible, drawn.window, CAMERA) for i in drawn.instances]
    observed = Observed(drawn.instances, clouds, drawn.window, CAMERA).observations()
    found = ways(ObservedPipeline(segmenter=None, matchers={}))  # type: ignore[arg-type]
    assert len(found) == 2 * len(LABELS) + 2
    assert [found[DEFAULT](o, CAMERA) for o in observed] != []
    for each in observed:
        by_way = {label: sizing(each, CAMERA) for label, sizing in found.items()}
        assert by_way[DEFAULT].diameter_mm == size_fruitlet(each, CAMERA).diameter_mm
        outlines = {size.outline for size in by_way.values()}
        assert len(outlines) >= 4


def test_the_benchmarks_table_adds_up_the_papers_networks() -> None:
    def figures(stage: str, ms: float, mib: float) -> dict[str, object]:
        return {
            "stages_ms": {stage: ms},
            "median_ms": ms,
            "worst_ms": ms + 1,
            "cpu_ms": 2 * ms,
            "peak_mib": mib,
        }

    measured = {
        PAPER[0]: figures("segmentation", 4000.0, 900.0),
        PAPER[1]: figures("stereo", 90000.0, 3000.0)
        | {"note": ", 8 iterations INSTEAD OF 32, one run"},
    }
    result = {"machine": machine(), "threads": 2, "load_after": 0.1, "contenders": measured}
    *_, segmentation, stereo, both, _, _ = report(result)
    assert "INSTEAD OF 32" in stereo and CONTENDERS[PAPER[1]] in stereo
    assert cells(segmentation)[1:3] == ["", "4,000"]
    expected = ["", "4,000", "90,000", "0", "94,000", "94,002", "188,000", "", "3,900"]
    assert cells(both)[1:] == expected


def test_the_machine_is_described() -> None:
    about = machine()
    assert about["cores"] >= 1
    assert {type(about[label]) for label in ("AVX-512", "AMX")} == {bool}
