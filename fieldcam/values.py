"""What crosses a boundary between two parts of fieldcam.

All values are frozen. Images are RGB, uint8, shape (H, W, 3), with pixel
centres at integer coordinates. The camera frame is that of the rectified left
eye: x right, y down, z forward, in millimetres; `range_mm` is z. Disparity is
positive: the right-image column is the left-image column minus the disparity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any, Self, TypeVar

import numpy as np
import numpy.typing as npt

ImageU8 = npt.NDArray[np.uint8]
"""(H, W, 3) uint8 RGB, or (H, W) uint8 for one channel."""
BoolMask = npt.NDArray[np.bool_]
"""(h, w) bool."""
FloatMap = npt.NDArray[np.float32]
"""(H, W) float32; NaN where unknown."""
Points = npt.NDArray[np.float32]
"""(N, 3) float32 in the camera frame, mm."""
Floats = npt.NDArray[np.floating[Any]]
_Lengths = TypeVar("_Lengths", float, Floats)

READING_SCHEMA_VERSION = 1
"""Raised by one whenever the stored form of a ClusterReading changes."""

TAG_SIZE_MM = 27.95
"""Side of the black border of the authors' printed tag36h11; of a block's cards where it says
nothing else."""

HIGHEST_TAG_ID = 586
"""Of the family tag36h11."""


NEAREST_MM, FARTHEST_MM = 300.0, 600.0
"""Of the tag: the working range that the operator is told."""

BEST_RANGE_MM = (360.0, 516.0)
"""Where the authors' camera stood: 438 mm, give or take 78."""


class PixelFormat(StrEnum):
    """How a raw image holds its colours."""

    RGB8 = "rgb8"
    MONO8 = "mono8"
    BAYER_RG8 = "bayer_rg8"
    BAYER_GB8 = "bayer_gb8"
    BAYER_GR8 = "bayer_gr8"
    BAYER_BG8 = "bayer_bg8"


@dataclass(frozen=True, slots=True, eq=False)
class RawPair:
    """One triggered exposure of both eyes, as the camera gave it."""

    left: ImageU8
    """(H, W, 3) for RGB8, else (H, W)."""
    right: ImageU8
    pixel_format: PixelFormat
    taken_at: datetime
    """Host time of the exposure, timezone-aware."""
    left_timestamp_ns: int
    """The left eye's own clock; 0 where the camera has none."""
    right_timestamp_ns: int
    left_serial: str
    right_serial: str
    trigger_ordinal: int
    """Counts the triggers since the camera was opened; both eyes share it."""
    simulated: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class StereoPair:
    """A rectified pair: a point's two images lie on the same row."""

    left: ImageU8
    right: ImageU8
    torn: tuple[str, ...] = ()
    """Eyes, `left` or `right`, whose image lacks a part as it was stored."""

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.left.shape[1], self.left.shape[0]


@dataclass(frozen=True, slots=True)
class Calibration:
    """A rectified stereo camera: one focal length, one principal point.

    Both rectified eyes share `cx_px`, so disparity is zero at infinity.
    """

    width_px: int
    height_px: int
    focal_px: float
    cx_px: float
    cy_px: float
    baseline_mm: float

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of its images."""
        return self.width_px, self.height_px

    def range_mm(self, disparity_px: _Lengths) -> _Lengths:
        """Depth z of a point, or of an array (...) of them, with this disparity."""
        return self.focal_px * self.baseline_mm / disparity_px

    def disparity_px(self, range_mm: _Lengths) -> _Lengths:
        """Disparity of a point, or of an array (...) of them, at this depth z."""
        return self.focal_px * self.baseline_mm / range_mm

    def px_per_mm(self, range_mm: float) -> float:
        """How large a millimetre at this depth z stands in the image."""
        return self.focal_px / range_mm

    def places_px(self, points_mm: Floats) -> Floats:
        """Where points (..., 3) stand in the rectified left image: (..., 2) x, y."""
        x, y, z = (points_mm[..., axis] for axis in range(3))
        columns, rows = x / z * self.focal_px + self.cx_px, y / z * self.focal_px + self.cy_px
        return np.stack([columns, rows], axis=-1)

    def points_mm(self, places_px: Floats, range_mm: Floats) -> Floats:
        """Points (..., 3) that stand at (..., 2) x, y of the image, at a depth z (...)."""
        x = (places_px[..., 0] - self.cx_px) * range_mm / self.focal_px
        y = (places_px[..., 1] - self.cy_px) * range_mm / self.focal_px
        return np.stack([x, y, range_mm], axis=-1)


@dataclass(frozen=True, slots=True)
class TagPose:
    """One AprilTag (tag36h11) in the rectified left image."""

    id: int
    center_px: tuple[float, float]
    corners_px: tuple[tuple[float, float], ...]
    """Four corners in the detector's order (counter-clockwise from lower left)."""
    translation_mm: tuple[float, float, float] | None
    """Tag centre in the camera frame; None without a calibration."""
    rotation: tuple[tuple[float, float, float], ...] | None
    """Rows of the rotation from tag to camera frame."""
    decision_margin: float

    @property
    def range_mm(self) -> float | None:
        return None if self.translation_mm is None else self.translation_mm[2]


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle of whole pixels in an image; x1 and y1 are exclusive."""

    x0: int
    y0: int
    x1: int
    y1: int

    @classmethod
    def whole(cls, width_px: int, height_px: int) -> Self:
        """All of an image."""
        return cls(0, 0, width_px, height_px)

    @property
    def width(self) -> int:
        return self.x1 - self.x0

    @property
    def height(self) -> int:
        return self.y1 - self.y0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Row and column slices for indexing an array."""
        return slice(self.y0, self.y1), slice(self.x0, self.x1)

    def slices_in(self, outer: Region) -> tuple[slice, slice]:
        """The same for an array that shows no more than `outer`, which holds this region."""
        return (
            slice(self.y0 - outer.y0, self.y1 - outer.y0),
            slice(self.x0 - outer.x0, self.x1 - outer.x0),
        )

    def overlap(self, other: Region) -> Region:
        """What both share: of no width or no height where that is nothing."""
        x0, y0 = max(self.x0, other.x0), max(self.y0, other.y0)
        x1, y1 = min(self.x1, other.x1), min(self.y1, other.y1)
        return Region(x0, y0, max(x0, x1), max(y0, y1))

    def grown(self, margin_px: int) -> Region:
        """With a margin on all sides; it may reach beyond the image."""
        return Region(
            self.x0 - margin_px, self.y0 - margin_px, self.x1 + margin_px, self.y1 + margin_px
        )


@dataclass(frozen=True, slots=True, eq=False)
class Mask:
    """The pixels of one instance, as a small window of the image."""

    x0: int
    y0: int
    window: BoolMask
    """(h, w) bool; window[0, 0] is image pixel (x0, y0)."""

    @property
    def region(self) -> Region:
        height, width = self.window.shape
        return Region(self.x0, self.y0, self.x0 + width, self.y0 + height)

    @property
    def area_px(self) -> int:
        return int(self.window.sum())

    @property
    def center_px(self) -> tuple[float, float]:
        """Mean x and y of the pixels, of which there must be some."""
        rows, columns = np.nonzero(self.window)
        return float(columns.mean() + self.x0), float(rows.mean() + self.y0)

    @property
    def tight(self) -> Mask:
        """The same pixels in the smallest window that holds them; as it is without any."""
        rows = np.flatnonzero(self.window.any(axis=1))
        columns = np.flatnonzero(self.window.any(axis=0))
        if rows.size == 0:
            return self
        y0, y1, x0, x1 = int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1
        return Mask(self.x0 + x0, self.y0 + y0, self.window[y0:y1, x0:x1])

    def over(self, region: Region) -> BoolMask:
        """(region.height, region.width): its pixels in that part of the image."""
        shown = np.zeros((region.height, region.width), np.bool_)
        shared = region.overlap(self.region)
        shown[shared.slices_in(region)] = self.window[shared.slices_in(self.region)]
        return shown

    def shared_px(self, other: Mask) -> int:
        """Number of pixels that both masks of one image hold."""
        shared = self.region.overlap(other.region)
        if not (shared.width and shared.height):
            return 0
        own = self.window[shared.slices_in(self.region)]
        return int((own & other.window[shared.slices_in(other.region)]).sum())

    def iou(self, other: Mask) -> float:
        """Shared over joint area of two masks of one image, 0 to 1; 0 where both are empty."""
        shared = self.shared_px(other)
        return shared / (self.area_px + other.area_px - shared) if shared else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Instance:
    """One fruitlet as the segmentation network sees it."""

    box_px: tuple[float, float, float, float]
    """x0, y0, x1, y1 of the visible part."""
    score: float
    visible: Mask
    visible_logits: FloatMap
    """(h, w) over `visible.region`: above zero is fruitlet."""
    whole_logits: FloatMap | None
    """(h, w) over `visible.region` for the whole fruitlet, hidden part included;
    None where the network predicts only the visible part."""
    seen_fraction: float | None = None
    """Share of the whole fruitlet that the network takes to show, 0 to 1; None where it
    does not say."""
    width_sd: float | None = None
    """Standard deviation of the whole mask's width as a share of it; None where it does not say."""


@dataclass(frozen=True, slots=True)
class Ellipse:
    """An ellipse in image pixels."""

    center_px: tuple[float, float]
    major_px: float
    """Full length of the long axis."""
    minor_px: float
    angle_rad: float
    """Of the long axis against the image's x axis, y down."""

    @property
    def area_px(self) -> float:
        return math.pi / 4 * self.major_px * self.minor_px

    def points_px(self, count: int) -> Floats:
        """(count, 2) x, y of points once around it, the first at the end of the long axis."""
        turn = np.linspace(0, 2 * math.pi, count, endpoint=False)
        along, across = self.major_px / 2 * np.cos(turn), self.minor_px / 2 * np.sin(turn)
        cosine, sine = math.cos(self.angle_rad), math.sin(self.angle_rad)
        x = self.center_px[0] + along * cosine - across * sine
        y = self.center_px[1] + along * sine + across * cosine
        return np.stack([x, y], axis=1)


class Flag(StrEnum):
    """Why a fruitlet was seen but not sized."""

    HIDDEN = "hidden"
    NO_DEPTH = "no_depth"
    BAD_OUTLINE = "bad_outline"
    CUT_BY_BORDER = "cut_by_border"
    OUTLIER = "outlier"


class Status(StrEnum):
    """What the operator should do with a capture."""

    ACCEPT = "accept"
    CONFIRM = "confirm"
    RETAKE = "retake"


class ReasonCode(StrEnum):
    """Why a verdict is not a plain ACCEPT."""

    NO_TAG = "no_tag"
    WRONG_TAG = "wrong_tag"
    SEVERAL_TAGS = "several_tags"
    NO_FRUITLETS = "no_fruitlets"
    FEWER_THAN_BEFORE = "fewer_than_before"
    TOO_DARK = "too_dark"
    OVEREXPOSED = "overexposed"
    BLURRED = "blurred"
    CUT_BY_BORDER = "cut_by_border"
    TOO_NEAR = "too_near"
    TOO_FAR = "too_far"
    TOO_COARSE = "too_coarse"
    NO_DEPTH = "no_depth"
    SWAPPED_EYES = "swapped_eyes"
    MISPAIRED = "mispaired"
    TORN = "torn"
    CALIBRATION_DRIFT = "calibration_drift"
    UNSURE_FRUIT = "unsure_fruit"


@dataclass(frozen=True, slots=True)
class Reason:
    """One reason of a verdict, with its sentence for the operator."""

    code: ReasonCode
    text: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """What to do with a capture, and why."""

    status: Status
    reasons: tuple[Reason, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Fruitlet:
    """One fruitlet of one capture."""

    id: int
    in_target: bool
    diameter_mm: float | None
    """Equatorial diameter; None where it was seen but not sized."""
    center_px: tuple[float, float]
    """Centre of the fitted outline, or of the mask where none was fitted."""
    box_px: tuple[float, float, float, float]
    score: float
    disparity_px: float | None
    range_mm: float | None
    """Depth of the visible surface's median point."""
    visible_fraction: float
    """Visible area over the area of the whole outline, 0 to 1."""
    flags: tuple[Flag, ...]
    mask: Mask
    outline: Ellipse | None
    cluster: int | None
    """Index of the fruitlet's cluster in this capture; None when unassigned."""
    centroid_mm: tuple[float, float, float] | None
    cloud_mm: Points
    """(N, 3) visible surface, thinned to a 1 mm grid; empty without depth."""
    sd_mm: float | None = None
    """Standard deviation of the diameter; None where there is none, or it was not recorded."""


class Method(StrEnum):
    """How a fruitlet's diameter is read off its mask and disparity."""

    DEFAULT = "default"
    PAPER = "paper"


class Matcher(StrEnum):
    """Which stereo matcher gives the disparity."""

    RAFT = "raft"
    SGBM = "sgbm"


@dataclass(frozen=True, slots=True)
class Settings:
    """What the operator can choose about one analysis."""

    method: Method = Method.DEFAULT
    stereo: Matcher = Matcher.RAFT
    whole_image: bool = False
    tag_size_mm: float = TAG_SIZE_MM


@dataclass(frozen=True, slots=True)
class Expectation:
    """What was known about a cluster before the capture."""

    tag_id: int | None = None
    fruitlets: int | None = None
    """How many living fruitlets were counted on the last visit."""


@dataclass(frozen=True, slots=True, eq=False)
class DisparityWindow:
    """Disparity of the part of the left image that was searched."""

    region: Region
    disparity_px: FloatMap
    """(region.height, region.width); NaN where unknown."""

    def over(self, wanted: Region) -> FloatMap:
        """(wanted.height, wanted.width) of any part of the image; NaN where it was not searched."""
        found = np.full((wanted.height, wanted.width), np.nan, np.float32)
        shared = wanted.overlap(self.region)
        found[shared.slices_in(wanted)] = self.disparity_px[shared.slices_in(self.region)]
        return found


@dataclass(frozen=True, slots=True, eq=False)
class ClusterReading:
    """All that one stereo pair says about one tagged cluster.

    Holds what later steps need, so that no stored pair has to be run again.
    """

    tag: TagPose | None
    tags_seen: tuple[int, ...]
    fruitlets: tuple[Fruitlet, ...]
    verdict: Verdict
    window: DisparityWindow | None
    calibration: Calibration
    settings: Settings
    expectation: Expectation
    faint_px: tuple[tuple[float, float], ...] = ()
    """Middles (x, y) of what may be a fruitlet, but did not look enough like one."""
    unsure_px: tuple[tuple[float, float], ...] = ()
    """Middles (x, y) of what may be fruit of the target that was not found or not sized."""
    tag_size_error: float | None = None
    """(measured - printed) / printed side of the tag by triangulation; None where not both eyes
    saw it, or an early version read the picture."""
    timing_ms: dict[str, float] = field(default_factory=dict)
    models: dict[str, str] = field(default_factory=dict)
    """SHA-256 of each network's file, by its role."""
    software_version: str = ""
    schema_version: int = READING_SCHEMA_VERSION

    @property
    def target(self) -> tuple[Fruitlet, ...]:
        """The fruitlets of the tagged cluster."""
        return tuple(f for f in self.fruitlets if f.in_target)
