"""A small network trains, stops, resumes and becomes a graph that agrees with it."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from export.stereo_data import StereoBatch

torch = pytest.importorskip("torch")
pytest.importorskip("onnxruntime")
raft = pytest.importorskip("export.raft")
data = pytest.importorskip("export.stereo_data")
training = pytest.importorskip("export.train_stereo")
losses = pytest.importorskip("export.stereo_loss")
states = pytest.importorskip("export.stereo_state")
weights = pytest.importorskip("export.weights_file")
conversion = pytest.importorskip("export.export_stereo")

pytestmark = pytest.mark.export

TINY = replace(
    raft.SHIPPED,
    hidden_dims=(8, 8, 8),
    encoder_widths=(8, 8, 8),
    feature_dim=8,
    motion_dim=8,
    motion_hidden_dim=8,
    head_dim=8,
)


def _batch() -> StereoBatch:
    """A noise picture moved by 6 px: everything matches except the first columns."""
    rng = np.random.default_rng(1)
    left = rng.integers(0, 255, (64, 64, 3), dtype=np.uint8)
    flags = np.ones((64, 64), bool)
    flat = np.full((64, 64), 6, np.float32)
    pair = data.StereoSample(left, np.roll(left, -6, axis=1), flat, flags, flags, flags)
    batch: StereoBatch = data.to_batch([pair])
    return batch


@pytest.mark.parametrize("config", [TINY, replace(TINY, n_downsample=3, n_gru_layers=3)])
def test_outputs_have_the_size_of_the_input(config: object) -> None:
    network = raft.RaftStereo(config).eval()
    left = torch.rand(1, 3, 64, 96) * 255
    prediction = network(left, left, 3)
    assert [tuple(d.shape) for d in prediction.disparities] == [(1, 1, 64, 96)] * 3
    disparity, confidence = network.predict(left, left, 3)
    assert torch.allclose(disparity, prediction.disparities[-1])
    assert torch.allclose(confidence, prediction.confidence)


def test_network_without_the_head_is_always_sure() -> None:
    network = raft.RaftStereo(replace(TINY, confidence=False)).eval()
    left = torch.rand(1, 3, 32, 64) * 255
    assert network.predict(left, left, 1)[1].min() > 5


def test_correlation_is_highest_at_the_match_and_its_loss_knows() -> None:
    batch = _batch()
    right_cells = torch.full((1, 16, 16, 16), -4.0)
    column = torch.arange(16)
    # 6 px are one and a half cells of 4 px: the match lies between two cells.
    for shift in (1, 2):
        right_cells[:, :, column[2:], column[2:] - shift] = 4.0
    matched = losses.matching_loss(right_cells, batch)
    assert matched < 0.8
    assert losses.matching_loss(right_cells.flip(-1), batch) > matched + 3


def test_confidence_is_learnt_from_what_is_right_not_from_what_is_seen() -> None:
    batch = _batch()
    off = torch.full_like(batch.disparity, 6.0)
    off[..., :32] += 3.0
    sure = torch.where(off == 6.0, 9.0, -9.0)
    volume = torch.zeros(1, 16, 16, 16)
    told = [
        float(losses.stereo_loss(raft.StereoPrediction([off], c, volume), batch).confidence)
        for c in (sure, -sure)
    ]
    assert told[0] < 0.01 < 5 < told[1]


def test_a_few_steps_lower_the_loss() -> None:
    state = states.TrainingState(raft.RaftStereo(TINY), 4e-3, 0)
    state.set_rate(0.03)
    batch = _batch()
    totals = [float(training.step(state, batch, 3).total) for _ in range(16)]
    assert np.mean(totals[-3:]) < 0.8 * np.mean(totals[:3])


def test_rate_rises_then_falls_to_almost_nothing() -> None:
    state = states.TrainingState(raft.RaftStereo(TINY), 1.0, 0)
    rates = [state.set_rate(share) for share in (0.0, 0.03, 0.5, 1.0, 1.7)]
    assert rates == pytest.approx([0.1, 1.0, 0.52, 0.02, 0.02], abs=0.03)


def test_a_stopped_run_continues_as_if_it_had_not_stopped(tmp_path: Path) -> None:
    batch = _batch()
    whole = states.TrainingState(raft.RaftStereo(TINY), 1e-3, 0)
    for _ in range(2):
        training.step(whole, batch, 2)
        whole.progress.batches += 1
    whole.save(tmp_path / "stereo.pt")
    resumed = states.TrainingState(raft.RaftStereo(TINY), 1e-3, 99)
    resumed.restore(tmp_path / "stereo.pt")
    assert resumed.progress == whole.progress
    for state in (whole, resumed):
        training.step(state, batch, 2)
    for name, value in whole.average.state_dict().items():
        assert torch.allclose(value, resumed.average.state_dict()[name], atol=1e-6), name
    assert not list(tmp_path.glob("*.partial"))


def test_command_trains_resumes_and_logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training, "SHIPPED", TINY)
    monkeypatch.setattr(data, "SHAPES", ((1, 64),))
    monkeypatch.setattr(data, "LayeredScenes", partial(data.LayeredScenes, textures=1))
    monkeypatch.setattr(training, "drawn_batches", lambda _: data.drawn_batches(1, 64))
    # Every step takes ten seconds on this clock.
    monkeypatch.setattr(training, "monotonic", count(0.0, 10.0).__next__)
    (tmp_path / "train").mkdir()
    common = ["--data", str(tmp_path), "--out", str(tmp_path), "--workers", "0"]
    training.main([*common, "--minutes", "0.5"])
    training.main([*common, "--minutes", "1"])
    lines = [json.loads(line) for line in (tmp_path / "stereo.jsonl").read_text().splitlines()]
    reports = [line for line in lines if "drawn_epe_px" in line]
    assert [report["batches"] for report in reports] == [3, 6]


def test_a_run_begins_with_the_weights_of_an_earlier_one(tmp_path: Path) -> None:
    network = raft.RaftStereo(TINY)
    states.save_network(network, {"seed": 7}, tmp_path / "start.safetensors")
    again, about = states.load_network(tmp_path / "start.safetensors")
    assert about == {"seed": 7}
    state = states.TrainingState(again, 1e-3, 0)
    before = {k: v.clone() for k, v in state.model.named_buffers()}
    training.step(state, _batch(), 2, training.Manner(fixed_norms=True, bfloat16=True))
    assert all(torch.equal(v, before[k]) for k, v in state.model.named_buffers())
    assert any(
        not torch.equal(v, network.state_dict()[k]) for k, v in state.model.state_dict().items()
    )


@pytest.mark.parametrize("content", [b"", b"no weights", b"\x08\0\0\0\0\0\0\0{}      "])
def test_weights_that_are_none_are_told_in_one_sentence(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.safetensors"
    path.write_bytes(content)
    with pytest.raises(weights.WeightsError, match=r"x\.safetensors holds no weights"):
        states.load_network(path)


def test_weights_of_another_shape_are_told_in_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "x.safetensors"
    weights.save_tensors(torch.nn.Linear(2, 2), TINY.as_dict(), {}, path)
    with pytest.raises(weights.WeightsError, match="another network than RAFT-Stereo"):
        states.load_network(path)


def test_graph_agrees_with_its_network_at_any_size(tmp_path: Path) -> None:
    network = raft.RaftStereo(TINY).eval()
    exported = conversion.export_onnx(network, 3, tmp_path / "tiny.onnx")
    assert exported.parity_px < 1e-3
    conversion.write_manifest(tmp_path, {"old": True})
    (tmp_path / "manifest.json").write_text(
        json.dumps({"schema": 1, "segmentation": {"file": "s.onnx"}, "stereo": {"old": True}})
    )
    entry = conversion.manifest_entry(exported, network.config, 3, {"seed": 1})
    conversion.write_manifest(tmp_path, entry)
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert manifest["segmentation"] == {"file": "s.onnx"}
    assert manifest["stereo"]["sha256"] == exported.sha256
    assert (manifest["stereo"]["multiple"], manifest["stereo"]["search_px"]) == (16, 32)


def test_public_checkpoint_loads_strictly(tmp_path: Path) -> None:
    plain = replace(TINY, confidence=False)
    source = raft.RaftStereo(plain)
    saved = {f"module.{name}": value for name, value in source.state_dict().items()}
    torch.save(saved, tmp_path / "public.pth")
    loaded = conversion.load_public(tmp_path / "public.pth", plain)
    assert torch.equal(loaded.cnet.conv1.weight, source.cnet.conv1.weight)
    del saved["module.cnet.conv1.weight"]
    torch.save(saved, tmp_path / "public.pth")
    with pytest.raises(RuntimeError, match=r"cnet\.conv1\.weight"):
        conversion.load_public(tmp_path / "public.pth", plain)


def test_a_stopped_command_leaves_a_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training, "SHIPPED", TINY)
    monkeypatch.setattr(data, "SHAPES", ((1, 64),))
    monkeypatch.setattr(data, "LayeredScenes", partial(data.LayeredScenes, textures=1))
    options = training._parser().parse_args(
        ["--data", str(tmp_path), "--out", str(tmp_path), "--workers", "0", "--minutes", "60"]
    )
    (tmp_path / "train").mkdir()
    state = states.TrainingState(raft.RaftStereo(TINY), 1e-3, 0)
    asked = iter([False, False, True])
    training.train(state, options, tmp_path / "stereo.pt", lambda: next(asked))
    assert state.progress.batches == 2
    again = states.TrainingState(raft.RaftStereo(TINY), 1e-3, 1)
    again.restore(tmp_path / "stereo.pt")
    assert again.progress.batches == 2
