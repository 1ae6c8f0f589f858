"""ONNX networks, opened when they are first needed."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import onnxruntime
from onnxruntime.capi.onnxruntime_pybind11_state import (
    Fail,
    InvalidArgument,
    InvalidGraph,
    InvalidProtobuf,
    NoSuchFile,
    RuntimeException,
)
from onnxruntime.capi.onnxruntime_pybind11_state import (
    NotImplemented as OperatorMissing,
)

from fieldcam.errors import ModelMissing
from fieldcam.images.pixels import as_rgb

THREADS = 2
"""A laptop's cores; more threads than cores make every run slower."""
Arrays = Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True, slots=True)
class Signature:
    """Names that a graph must have; it may give more outputs than these."""

    inputs: frozenset[str]
    outputs: frozenset[str]

    def fits(self, session: onnxruntime.InferenceSession) -> bool:
        inputs = {each.name for each in session.get_inputs()}
        outputs = {each.name for each in session.get_outputs()}
        return self.inputs == inputs and self.outputs <= outputs


class Network(Protocol):
    """Something that turns named arrays into named arrays."""

    def run(self, inputs: Arrays) -> dict[str, npt.NDArray[Any]]:
        """Arrays by name; their shapes are the graph's."""
        ...

    def warm_up(self) -> None: ...


class OnnxModel:
    """One network in one file; the file is opened on the first run."""

    def __init__(self, path: Path, signature: Signature, threads: int = THREADS) -> None:
        self.path = path
        self._signature = signature
        self._threads = threads

    def run(self, inputs: Arrays) -> dict[str, npt.NDArray[Any]]:
        """Run the network; outputs are keyed by their names in the graph."""
        session = self._session
        names = [output.name for output in session.get_outputs()]
        try:
            given = session.run(names, dict(inputs))
        except (Fail, InvalidArgument, RuntimeException) as error:
            raise ModelMissing(
                f"{self.path.name} cannot take a picture of this size.",
                "Export it for pictures of any size.",
            ) from error
        return dict(zip(names, given, strict=True))

    def warm_up(self) -> None:
        """Open the file now, so that the first picture does not wait for it."""
        _ = self._session

    @functools.cached_property
    def _session(self) -> onnxruntime.InferenceSession:
        if not self.path.is_file():
            raise ModelMissing(
                f"The network {self.path.name} is not at {self.path.parent}.",
                "Run `fieldcam models verify` to see which files are missing.",
            )
        session = self._open()
        if not self._signature.fits(session):
            raise ModelMissing(
                f"{self.path.name} is a network for something else: "
                f"it must take {_listed(self._signature.inputs)} "
                f"and give {_listed(self._signature.outputs)}.",
                "Add the right file with `fieldcam models add`.",
            )
        return session

    def _open(self) -> onnxruntime.InferenceSession:
        try:
            return onnxruntime.InferenceSession(
                str(self.path), _options(self._threads), providers=["CPUExecutionProvider"]
            )
        except (
            Fail,
            InvalidArgument,
            InvalidGraph,
            InvalidProtobuf,
            NoSuchFile,
            OperatorMissing,
        ) as error:
            raise ModelMissing(
                f"{self.path.name} is not a network that this version can run.",
                "Run `fieldcam models verify`; if the file was added by hand, export it again.",
            ) from error


def _listed(names: frozenset[str]) -> str:
    return ", ".join(sorted(names))


def _options(threads: int) -> onnxruntime.SessionOptions:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    # Spinning threads keep a core busy between two runs, which the screen needs.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 3
    return options


def network_image(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """Channels first: (H, W, 3) or (H, W) uint8 to (3, H, W) float32, 0 to 255."""
    rgb = as_rgb(image)
    return np.ascontiguousarray(rgb.transpose(2, 0, 1), dtype=np.float32)
