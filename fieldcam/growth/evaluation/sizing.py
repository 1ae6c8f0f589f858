"""Sizes by camera against those by calipers (the paper's Table 2)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import date

import numpy as np

from fieldcam.growth.agreement import Agreement, agreement
from fieldcam.growth.records import FruitletRecord, Presence
from fieldcam.values import Floats

OUTLIER_Z = 3.0
"""Sizes by camera this far from their day's mean are left out (paper, "Fruitlet Sizing")."""
FEWEST_FOR_A_LINE = 3
"""Through two points there is always one."""


@dataclass(frozen=True, slots=True)
class SizePair:
    """One fruit on one day, matched by its name; one of the sizes may be missing."""

    tag_id: int
    fruit: str
    day: date
    camera_mm: float | None
    calipers_mm: float | None
    shown: bool
    """A picture of that day shows it."""
    outlier: bool = False
    """Its size by camera is out of all proportion, and is left out."""

    @property
    def error_mm(self) -> float | None:
        """Camera less calipers; None where the two are not to be compared."""
        if self.camera_mm is None or self.calipers_mm is None or self.outlier:
            return None
        return self.camera_mm - self.calipers_mm


@dataclass(frozen=True, slots=True)
class SizingScore:
    """How well the camera sizes fruit that calipers measured; None where nothing was compared."""

    measured: int
    """Fruit by calipers."""
    sized: int
    """Of those by camera too, outliers among them."""
    outliers: int
    mae_mm: float | None
    mape_pct: float | None
    """Errors in percent of the size by calipers."""
    r2: float | None
    """Of a straight line fitted to camera over calipers, as in the paper: it says how well a
    line fits, and nothing of bias and scale."""
    agreement: Agreement | None

    @property
    def sized_pct(self) -> float | None:
        return 100.0 * self.sized / self.measured if self.measured else None


def pair_sizes(
    camera: Iterable[FruitletRecord], calipers: Iterable[FruitletRecord]
) -> tuple[SizePair, ...]:
    """Matched by tag, name and day, and never by size; by day, tag and name.

    Holds whatever has a size on either side; outliers are marked.
    """
    ours = {(f.tag_id, f.fruitlet, day): s for f in camera for day, s in f.sightings.items()}
    theirs = {(f.tag_id, f.fruitlet, day): s for f in calipers for day, s in f.sightings.items()}
    pairs = []
    for key in sorted({*ours, *theirs}, key=lambda key: (key[2], key[0], key[1])):
        one, other = ours.get(key), theirs.get(key)
        camera_mm = None if one is None else one.diameter_mm
        calipers_mm = None if other is None else other.diameter_mm
        shown = one is not None and one.presence in (Presence.SIZED, Presence.SEEN)
        if camera_mm is not None or calipers_mm is not None:
            pairs.append(SizePair(*key, camera_mm, calipers_mm, shown))
    return _outliers_marked(pairs)


def score_sizes(pairs: Sequence[SizePair]) -> SizingScore:
    """One column of the table: a day's pairs, or those of all days."""
    measured = [p for p in pairs if p.calipers_mm is not None]
    sized = [p for p in measured if p.camera_mm is not None]
    camera, calipers = compared(pairs)
    errors = camera - calipers
    return SizingScore(
        len(measured),
        len(sized),
        sum(p.outlier for p in sized),
        mae_mm=float(np.abs(errors).mean()) if len(errors) else None,
        mape_pct=float(100.0 * np.abs(errors / calipers).mean()) if len(errors) else None,
        r2=line_r2(calipers, camera),
        agreement=agreement(camera.tolist(), calipers.tolist()),
    )


def compared(pairs: Iterable[SizePair]) -> tuple[Floats, Floats]:
    """(N,) sizes by camera and (N,) by calipers of fruit that have both; outliers are left out."""
    both = [(p.camera_mm, p.calipers_mm) for p in pairs if p.error_mm is not None]
    sizes = np.array(both, np.float64).reshape(-1, 2)
    return sizes[:, 0], sizes[:, 1]


def line_r2(x: Floats, y: Floats) -> float | None:
    """Share of the variance of y (N,) that the best straight line over x (N,) explains."""
    if len(x) < FEWEST_FOR_A_LINE or np.ptp(x) == 0 or np.ptp(y) == 0:
        return None
    return float(np.corrcoef(x, y)[0, 1] ** 2)


def only_by_camera(pairs: Iterable[SizePair]) -> tuple[SizePair, ...]:
    """Fruit without a size by calipers on a day on which the camera has one."""
    return tuple(p for p in pairs if p.calipers_mm is None)


def only_by_calipers(pairs: Iterable[SizePair]) -> tuple[SizePair, ...]:
    """Fruit that no picture shows, or none names, on a day on which calipers measured it."""
    return tuple(p for p in pairs if not p.shown)


def _outliers_marked(pairs: Sequence[SizePair]) -> tuple[SizePair, ...]:
    by_day: dict[date, list[float]] = {}
    for pair in pairs:
        if pair.camera_mm is not None:
            by_day.setdefault(pair.day, []).append(pair.camera_mm)
    spread = {day: (float(np.mean(s)), float(np.std(s))) for day, s in by_day.items()}
    return tuple(replace(p, outlier=_is_outlier(p, *spread.get(p.day, (0, 0)))) for p in pairs)


def _is_outlier(pair: SizePair, mean_mm: float, sd_mm: float) -> bool:
    if pair.camera_mm is None or sd_mm == 0:
        return False
    return abs(pair.camera_mm - mean_mm) >= OUTLIER_Z * sd_mm
