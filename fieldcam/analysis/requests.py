"""What the app asks of its analysis process, and the JSON form of it.

Each request gets one reply before the next is sent.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path

from fieldcam.exchange.json_fields import Json, number, optional, text, truth, whole
from fieldcam.exchange.reading_parts import decode_calibration, encode_calibration
from fieldcam.store.captures import SavedCapture
from fieldcam.values import Calibration, Expectation, Matcher, Method, Settings


@dataclass(frozen=True, slots=True)
class Setup:
    """What stays the same from pair to pair."""

    camera: Calibration | Path | None
    """Of pairs that are already rectified, or the file or folder that describes the camera;
    None where every picture comes with its own calibration, which goes before this one anyway."""
    settings: Settings = field(default_factory=Settings)
    data: Path | None = None
    """The data folder, where a user's own networks may lie; None for the shipped ones."""


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Load all that the first pair would otherwise wait for."""

    setup: Setup


@dataclass(frozen=True, slots=True)
class Analyse:
    """Read one saved pair."""

    saved: SavedCapture
    expectation: Expectation


@dataclass(frozen=True, slots=True)
class Look:
    """Find the tags in a preview."""

    image: Path
    """PGM or PPM of the left eye."""
    shrunk: int
    """Full-size pixels to one of its own."""
    calibration: Path | None = None
    """Describes the camera, before the setup's one."""


@dataclass(frozen=True, slots=True)
class Ping:
    """Say that you are alive."""


Request = WarmUp | Analyse | Look | Ping


def encode_request(request: Request) -> Json:
    match request:
        case WarmUp(setup):
            return {"ask": "warm_up"} | _encode_setup(setup)
        case Analyse(saved, expectation):
            return {
                "ask": "analyse",
                "key": saved.key,
                "files": [str(path) for path in (saved.left, saved.right, saved.record)],
                "calibration": _text(saved.calibration),
                "expectation": asdict(expectation),
            }
        case Look(image, shrunk, calibration):
            return {
                "ask": "look",
                "image": str(image),
                "shrunk": shrunk,
                "calibration": _text(calibration),
            }
        case Ping():
            return {"ask": "ping"}


def decode_request(document: Json) -> Request:
    """The app is trusted to ask for nothing else."""
    match document["ask"]:
        case "warm_up":
            return WarmUp(_decode_setup(document))
        case "analyse":
            left, right, record = (Path(name) for name in document["files"])
            calibration = optional(document["calibration"], Path)
            saved = SavedCapture(text(document["key"]), left, right, record, calibration)
            return Analyse(saved, _decode_expectation(document["expectation"]))
        case "look":
            calibration = optional(document["calibration"], Path)
            return Look(Path(document["image"]), whole(document["shrunk"]), calibration)
        case _:
            return Ping()


def _encode_setup(setup: Setup) -> Json:
    camera = setup.camera
    return {
        "camera": encode_calibration(camera) if isinstance(camera, Calibration) else _text(camera),
        "settings": asdict(setup.settings),
        "data": _text(setup.data),
    }


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)


def _decode_setup(document: Json) -> Setup:
    camera, settings = document["camera"], document["settings"]
    return Setup(
        decode_calibration(camera) if isinstance(camera, dict) else optional(camera, Path),
        Settings(
            method=Method(settings["method"]),
            stereo=Matcher(settings["stereo"]),
            whole_image=truth(settings["whole_image"]),
            tag_size_mm=number(settings["tag_size_mm"]),
        ),
        optional(document["data"], Path),
    )


def _decode_expectation(document: Json) -> Expectation:
    return Expectation(optional(document["tag_id"], whole), optional(document["fruitlets"], whole))
