"""What the Device screen says of camera, networks, disk, battery, calibration and analysis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from textwrap import shorten

from fieldcam.analysis.status import AnalysisState, AnalysisStatus
from fieldcam.calibration.drift import TAG_SIZE_BIAS
from fieldcam.calibration.stored_drift import MIN_PICTURES, TagSizes
from fieldcam.models import ModelFile, Models
from fieldcam.session.battery import Battery
from fieldcam.session.state import CameraState
from fieldcam.store.queries.usage import LastCamera
from fieldcam.words import number_of

CAMERA = {
    CameraState.OPENING: "is being opened",
    CameraState.READY: "ready",
    CameraState.EXPOSING: "takes a picture",
    CameraState.LOST: "does not answer: check its cable, then press Space on the walk",
}
HASH = 12
"""Characters of a hash that are shown, as everywhere."""
LOW_PERCENT = 15


@dataclass(frozen=True, slots=True)
class Fact:
    """One line; `bad` where somebody should do something."""

    name: str
    text: str
    bad: bool = False


@dataclass(frozen=True, slots=True)
class Disk:
    """Room in the data folder."""

    free_bytes: int
    reserve_bytes: int
    captures_left: int | None
    """None before the first picture says how large they are."""


def camera_facts(
    state: CameraState, last: LastCamera | None, notes: Sequence[str] = ()
) -> Iterator[Fact]:
    """`notes` are those of its last opening."""
    yield Fact("camera", CAMERA[state], state is CameraState.LOST)
    yield from (Fact("", note) for note in notes)
    if last is not None:
        eyes = f"left eye {last.left_serial}, right eye {last.right_serial}"
        yield Fact("", f"{last.taken_at:%d %b %H:%M}: {eyes}")


def model_facts(models: Models | None) -> Iterator[Fact]:
    if models is None:
        yield Fact("networks", "not known here")
        return
    for model in models.files:
        yield Fact(model.role, f"{model.sha256[:HASH]}, {model.origin}: {_training(model)}")
    yield Fact("", models.honesty)


def disk_fact(disk: Disk) -> Fact:
    left = disk.captures_left
    room = "" if left is None else f", room for {number_of(left, 'picture')}"
    reserve = "no reserve"
    if disk.reserve_bytes:
        reserve = f"{disk.reserve_bytes / 1e6:.0f} MB in reserve"
    bad = disk.captures_left == 0 or not disk.reserve_bytes
    return Fact("disk", f"{disk.free_bytes / 1e9:.1f} GB free, {reserve}{room}", bad)


def battery_fact(batteries: Sequence[Battery]) -> Fact:
    if not batteries:
        return Fact("battery", "no battery")
    text = ", ".join(f"{battery.percent} % {battery.status}".rstrip() for battery in batteries)
    low = max(battery.percent for battery in batteries) < LOW_PERCENT
    return Fact("battery", text, low and all(b.status == "discharging" for b in batteries))


def calibration_facts(uncalibrated: str, sizes: TagSizes | None) -> Iterator[Fact]:
    """The printed tag against what the camera makes of it; None while that is computed."""
    if uncalibrated:
        yield Fact("calibration", uncalibrated, bad=True)
        return
    if sizes is None:
        yield Fact("calibration", "is being checked")
        return
    if sizes.measured_mm is None or sizes.drift is None:
        yield Fact("calibration", f"known after {MIN_PICTURES} pictures with a tag")
        return
    measured = f"tag printed {sizes.printed_mm:g} mm, measured {sizes.measured_mm:.2f} mm"
    pictures = number_of(len(sizes.errors), "picture")
    yield Fact("calibration", f"{measured} in {pictures}", sizes.drifted)
    if sizes.drifted:
        text = (
            f"DRIFT: sizes are off by about {sizes.drift:+.1%}; run `fieldcam calibrate`, unless"
            " the tags have another size (Set-up)"
        )
        yield Fact("", text, bad=True)
    else:
        off = sizes.drift + TAG_SIZE_BIAS
        usual = f"{TAG_SIZE_BIAS:+.1%} is usual, as white grows into black"
        yield Fact("", f"fits: {off:+.1%} off; {usual}")


def analysis_facts(status: AnalysisStatus) -> Iterator[Fact]:
    restarts = f"restarts {status.restarts}, waiting {status.pending}"
    off = status.state is AnalysisState.STOPPED
    yield Fact("analysis", f"{status.state}, {restarts}{'; R starts it again' if off else ''}", off)
    yield Fact("", f"last error: {status.last_error}" if status.last_error else "no error")


def _training(model: ModelFile) -> str:
    """What its data were, in a line; how they were made is in the manifest."""
    data = model.facts.get("data")
    if not isinstance(data, str):
        return "trained on data unknown here"
    return shorten(f"trained on {data.partition(' (')[0]}", 150, placeholder=" ...")
