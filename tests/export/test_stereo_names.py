"""Parameter names and shapes agree with the published RAFT-Stereo checkpoints."""

from __future__ import annotations

import pytest

torch = pytest.importorskip("torch")
raft = pytest.importorskip("export.raft")

pytestmark = pytest.mark.export

PUBLISHED = [
    ("cnet.conv1.weight", (64, 3, 7, 7)),
    ("cnet.norm1.running_var", (64,)),
    ("cnet.layer1.1.conv2.weight", (64, 64, 3, 3)),
    ("cnet.layer2.0.norm3.weight", (96,)),
    ("cnet.layer2.0.downsample.0.weight", (96, 64, 1, 1)),
    ("cnet.layer2.0.downsample.1.weight", (96,)),
    ("cnet.layer5.1.norm2.num_batches_tracked", ()),
    ("cnet.outputs08.1.0.conv1.weight", (128, 128, 3, 3)),
    ("cnet.outputs16.0.1.bias", (128,)),
    ("cnet.outputs32.1.weight", (128, 128, 3, 3)),
    ("update_block.encoder.convc1.weight", (64, 36, 1, 1)),
    ("update_block.encoder.convf1.weight", (64, 2, 7, 7)),
    ("update_block.encoder.conv.weight", (126, 128, 3, 3)),
    ("update_block.gru08.convz.weight", (128, 384, 3, 3)),
    ("update_block.gru16.convr.weight", (128, 384, 3, 3)),
    ("update_block.gru32.convq.weight", (128, 256, 3, 3)),
    ("update_block.flow_head.conv2.weight", (2, 256, 3, 3)),
    ("update_block.mask.0.weight", (256, 128, 3, 3)),
    ("update_block.mask.2.weight", (144, 256, 1, 1)),
    ("context_zqr_convs.2.weight", (384, 128, 3, 3)),
    ("fnet.layer3.0.downsample.0.weight", (128, 96, 1, 1)),
    ("fnet.conv2.weight", (256, 128, 1, 1)),
]


@pytest.fixture(scope="module")
def default() -> dict[str, tuple[int, ...]]:
    network = raft.RaftStereo(raft.OFFICIAL)
    return {name: tuple(value.shape) for name, value in network.state_dict().items()}


@pytest.mark.parametrize(("name", "shape"), PUBLISHED)
def test_published_parameter_is_there(
    default: dict[str, tuple[int, ...]], name: str, shape: tuple[int, ...]
) -> None:
    assert default[name] == shape


def test_default_has_as_many_entries_as_published(default: dict[str, tuple[int, ...]]) -> None:
    assert len(default) == 337
    # Instance normalisation has no parameters, and no confidence head is published.
    assert not [name for name in default if name.startswith("fnet") and "norm" in name]
    assert not [name for name in default if "confidence" in name]


def test_realtime_shares_its_backbone() -> None:
    names = raft.RaftStereo(raft.REALTIME).state_dict()
    assert len(names) == 309
    assert tuple(names["conv2.1.weight"].shape) == (256, 128, 3, 3)
    assert tuple(names["update_block.mask.2.weight"].shape) == (576, 256, 1, 1)
    assert not [name for name in names if name.startswith("fnet")]


@pytest.mark.parametrize("config", [raft.OFFICIAL, raft.REALTIME, raft.SHIPPED])
def test_configuration_survives_a_round_trip(config: object) -> None:
    assert raft.RaftConfig.from_dict(config.as_dict()) == config  # type: ignore[attr-defined]
