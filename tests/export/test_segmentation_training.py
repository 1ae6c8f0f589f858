"""The two stages, ignored fruitlets, resuming and the exported graph."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torchvision.models.detection import MaskRCNN
from torchvision.models.detection.backbone_utils import resnet_fpn_backbone

from export import drawn_crops as drawn
from export import export_segmentation as conversion
from export import mask_rcnn as network
from export import roi_ignore as ignore
from export import segmentation_data as data
from export import segmentation_state as state
from export import train_segmentation as train
from export.mask_branch import MaskShape
from export.segmentation_window import CropSettings

pytestmark = pytest.mark.export

SHAPE = network.NetworkShape(
    stem=8,
    widths=(8, 8, 8, 8),
    pyramid=8,
    box_hidden=16,
    proposals=20,
    mask=MaskShape(cells=16, width=8, detail_width=8, joined_width=8),
)


@pytest.fixture(scope="module")
def shards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("drawn")
    for part, seeds in (("train", (5, 9)), ("val", (12,))):
        (folder / part).mkdir()
        for seed in seeds:
            canvas = drawn.draw_canvas(np.random.default_rng(seed))
            drawn.save_canvas(canvas, folder / part / f"{seed}.npz")
    return folder


def _recipe(shards: Path, out: Path, steps: int) -> train.Recipe:
    return train.Recipe(
        sources=data.Sources(drawn=shards / "train"),
        validation=data.Sources(drawn=shards / "val"),
        out=out,
        batch=2,
        threads=1,
        crop=CropSettings(size_px=96),
        shape=SHAPE,
        max_steps=steps,
    )


def _weights(module: torch.nn.Module) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in module.state_dict().items()}


def _same(module: torch.nn.Module, before: dict[str, torch.Tensor]) -> bool:
    return all(torch.equal(v, before[k]) for k, v in module.state_dict().items())


def _batch() -> data.Batch:
    masks = torch.zeros(2, 2, 96, 96, dtype=torch.uint8)
    masks[0, :, 20:50, 10:45] = 255
    masks[1, :, 40:80, 50:90] = 255
    boxes = torch.tensor([[10.0, 20.0, 45.0, 50.0], [50.0, 40.0, 90.0, 80.0]])
    target = {"boxes": boxes, "labels": torch.ones(2, dtype=torch.int64), "masks": masks}
    return torch.randint(0, 255, (2, 3, 96, 96), dtype=torch.uint8), [target, target]


def test_stage_one_leaves_the_masks_alone(shards: Path, tmp_path: Path) -> None:
    run = train.Run(_recipe(shards, tmp_path, 1))
    masks, boxes = _weights(run.model.masks), _weights(run.model.box_heads)
    losses = run.step(_batch())
    assert "loss_mask" not in losses
    assert _same(run.model.masks, masks)
    assert not _same(run.model.box_heads, boxes)


def test_stage_two_freezes_proposals_and_box_heads(shards: Path, tmp_path: Path) -> None:
    run = train.Run(_recipe(shards, tmp_path, 1))
    run.start_masks()
    before = {name: _weights(getattr(run.model, name)) for name in ("rpn", "box_heads", "masks")}
    losses = run.step(_batch())
    assert losses["loss_mask"] > 0
    assert _same(run.model.rpn, before["rpn"])
    assert _same(run.model.box_heads, before["box_heads"])
    assert not _same(run.model.masks, before["masks"])


def test_a_run_goes_on_where_it_stopped(shards: Path, tmp_path: Path) -> None:
    first = train.Run(_recipe(shards, tmp_path, 3))
    first.train()
    again = train.Run(_recipe(shards, tmp_path, 5))
    assert again.progress.step == 3
    assert again.progress.samples == 6
    assert _same(again.model, _weights(first.model))
    assert _same(again.average, _weights(first.average))
    old, new = first.optimizer.state_dict(), again.optimizer.state_dict()
    assert len(new["state"]) == len(old["state"]) > 0
    again.train()
    assert again.progress.step == 5
    assert again.progress.elapsed_s > first.progress.elapsed_s
    lines = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert any("quality" in line for line in lines)


@pytest.mark.parametrize(
    ("step", "cooling_from", "share"),
    [(0, None, 0.01), (99, None, 1.0), (5000, None, 1.0), (1100, 1000, 0.8), (1500, 1000, 0.01)],
)
def test_rates_warm_up_hold_and_fall(step: int, cooling_from: int | None, share: float) -> None:
    progress = state.Progress(step_in_stage=step, cooling_from_step=cooling_from)
    assert train.rate_share(progress, 500) == pytest.approx(share)


def test_the_rate_falls_when_validation_has_stopped_improving(shards: Path, tmp_path: Path) -> None:
    run = train.Run(replace(_recipe(shards, tmp_path, 1), patience=2))
    for figure in (0.5, 0.6, 0.58, None):
        run.judge(figure)
        assert run.progress.cooling_from_step is None
    run.progress.step_in_stage = 700
    run.judge(0.59)
    assert run.progress.cooling_from_step == 700
    assert run.progress.best == 0.6


def test_a_stage_ends_when_its_rate_has_fallen(shards: Path, tmp_path: Path) -> None:
    recipe = replace(_recipe(shards, tmp_path, 1), max_steps=None, cooling_steps=2)
    run = train.Run(recipe)
    run.progress.cooling_from_step = 0
    run.progress.best = 0.7
    run.step(_batch())
    run.end_of_stage()
    assert run.progress.stage == 1
    run.step(_batch())
    run.end_of_stage()
    assert (run.progress.stage, run.progress.step_in_stage, run.progress.step) == (2, 0, 2)
    assert run.progress.best < 0
    run.progress.cooling_from_step = 0
    run.progress.step_in_stage = 2
    run.end_of_stage()
    assert run.finished


def test_a_run_from_earlier_weights_keeps_their_norms(shards: Path, tmp_path: Path) -> None:
    start = tmp_path / "start.safetensors"
    state.save_weights(network.FruitletMaskRCNN(SHAPE), {}, start)
    run = train.Run(replace(_recipe(shards, tmp_path, 1), start=start))
    before = {k: v.clone() for k, v in run.model.named_buffers()}
    run.step(_batch())
    assert all(torch.equal(v, before[k]) for k, v in run.model.named_buffers())


def test_photographs_with_boxes_alone_train_no_masks(shards: Path, tmp_path: Path) -> None:
    run = train.Run(_recipe(shards, tmp_path, 1))
    run.start_masks()
    images, targets = _batch()
    boxed = [{**t, "masks": t["masks"][:0]} for t in targets]
    losses = run.step((images, boxed))
    assert losses["loss_mask"] == 0
    assert losses["loss_classifier"] > 0


def test_anchors_on_ignored_fruitlets_are_not_punished() -> None:
    model = network.FruitletMaskRCNN(SHAPE)
    anchors = torch.tensor(
        [[10.0, 10, 40, 40], [60, 60, 90, 90], [62, 62, 88, 88], [100, 0, 130, 30]]
    )
    target = {"boxes": anchors[:2], "labels": torch.tensor([1, -1])}
    labels, _ = model.rpn.assign_targets_to_anchors([anchors], [target])
    assert labels[0].tolist() == [1.0, -1.0, -1.0, 0.0]
    matched, classes = model.box_heads.assign_targets_to_proposals(
        [anchors], [target["boxes"]], [target["labels"]]
    )
    assert classes[0].tolist() == [1, -1, -1, 0]
    assert int(matched[0][0]) == 0


def test_an_image_with_ignored_fruitlets_only_trains() -> None:
    model = network.FruitletMaskRCNN(SHAPE)
    target = {
        "boxes": torch.tensor([[10.0, 10, 40, 40]]),
        "labels": torch.tensor([-1]),
        "masks": torch.zeros(0, 2, 96, 96),
    }
    losses = model.losses(torch.rand(1, 3, 96, 96) * 255, [target], with_masks=True)
    assert all(bool(torch.isfinite(loss)) for loss in losses.values())
    assert float(losses["loss_mask"]) == 0.0


def test_ignored_boxes_also_cover_what_lies_inside_them() -> None:
    boxes = torch.tensor([[2.0, 2, 6, 6], [50, 50, 60, 60]])
    ignored = torch.tensor([[0.0, 0, 40, 40]])
    assert ignore.on_ignored(boxes, ignored).tolist() == [True, False]
    assert ignore.on_ignored(boxes, ignored[:0]).tolist() == [False, False]


@pytest.fixture(scope="module")
def graph() -> conversion.FruitletGraph:
    torch.manual_seed(3)
    return conversion.FruitletGraph(network.FruitletMaskRCNN(SHAPE).eval())


def _images(*sizes: tuple[int, int]) -> list[torch.Tensor]:
    torch.manual_seed(0)
    return [torch.rand(3, *size) * 255 for size in sizes]


def test_onnx_agrees_on_every_size(graph: conversion.FruitletGraph, tmp_path: Path) -> None:
    path = tmp_path / "s.onnx"
    conversion.write_onnx(graph, path)
    worst = conversion.check_parity(graph, path, _images((128, 128), (97, 161), (33, 40)))
    assert worst["boxes_px"] < 0.01
    found = conversion.run_session(conversion.open_session(path, 1), _images((128, 128))[0].numpy())
    assert len(found[0]) > 0
    assert found[3].shape == (len(found[0]), 2, 16, 16)
    sides = found[0][:, 2:] - found[0][:, :2]
    grown = found[2][:, 2:] - found[2][:, :2]
    assert np.allclose(grown, sides * SHAPE.mask.growth, atol=1e-3)


def test_onnx_without_detections(tmp_path: Path) -> None:
    model = network.FruitletMaskRCNN(SHAPE).eval()
    with torch.no_grad():
        model.box_heads.box_predictor.cls_score.bias.copy_(torch.tensor([30.0, -30.0]))
    path = tmp_path / "s.onnx"
    conversion.write_onnx(conversion.FruitletGraph(model), path)
    found = conversion.run_session(conversion.open_session(path, 1), _images((64, 96))[0].numpy())
    assert [v.shape for v in found] == [(0, 4), (0,), (0, 4), (0, 2, 16, 16), (0,), (0,)]


def test_manifest_keeps_the_other_role(
    graph: conversion.FruitletGraph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Drawn fruit gives an untrained network scores that tie within rounding.
    monkeypatch.setattr(conversion, "parity_images", lambda: _images((128, 128)))
    (tmp_path / "manifest.json").write_text('{"schema": 1, "stereo": {"file": "x.onnx"}}')
    weights = tmp_path / "model.safetensors"
    state.save_weights(graph.model, {"quality": {"recall": 0.5}}, weights)
    assert conversion.main([str(weights), "--out", str(tmp_path)]) == 0
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert manifest["stereo"] == {"file": "x.onnx"}
    assert manifest["segmentation"]["quality"] == {"recall": 0.5}
    assert len(manifest["segmentation"]["sha256"]) == 64


def test_a_stock_network_exports_its_own_class(tmp_path: Path) -> None:
    torch.manual_seed(1)
    backbone = resnet_fpn_backbone(backbone_name="resnet18", weights=None)
    stock = conversion.StockGraph(MaskRCNN(backbone, num_classes=3, rpn_post_nms_top_n_test=20))
    path = tmp_path / "stock.onnx"
    conversion.write_onnx(stock, path)
    images = _images((64, 96), (70, 65))
    assert conversion.check_parity(stock, path, images)["logits"] < 1e-3
    found = conversion.run_session(conversion.open_session(path, 1), images[0].numpy())
    assert len(found[0]) > 0
    assert found[3].shape == (len(found[0]), 1, 28, 28)
    assert np.array_equal(found[0], found[2])


def test_a_checkpoint_that_cannot_be_written_is_told_and_the_run_goes_on(
    shards: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = train.Run(_recipe(shards, tmp_path, 1))
    run.checkpoint = tmp_path / "gone" / "last.pt"
    run.save()
    assert "The checkpoint could not be written" in capsys.readouterr().err
    run.step(_batch())
    assert run.progress.step == 1
