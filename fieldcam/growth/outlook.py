"""What the growth of a block promises: the forecast, and all that stands beside it.

Stored pictures and caliper tables both end here, and text, document, page and screen
begin here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

from fieldcam.growth.crop import CropForecast, CropPlan, crop_forecast
from fieldcam.growth.forecast import Forecast, forecast, trend
from fieldcam.growth.influence import ClusterInfluence, influences
from fieldcam.growth.records import BlockRecord
from fieldcam.growth.sprays import SprayDay, last_spray
from fieldcam.growth.visits import chosen_interval
from fieldcam.growth.warnings.block import Warning, warnings_about


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """All that is known about the growth of a block."""

    found: Forecast
    trend: tuple[Forecast, ...]
    """A forecast at each visit that has one."""
    by_size_order: Forecast
    """The same as `found` with fruitlets matched by the order of their sizes alone."""
    crop: CropForecast | None
    """None where the bloom clusters of a tree were not counted."""
    warnings: tuple[Warning, ...]
    clusters: tuple[ClusterInfluence, ...]
    """The most influential first."""
    sprays: tuple[SprayDay, ...]

    @property
    def last_spray(self) -> SprayDay | None:
        """The last one before the second of the two visits, or on its day."""
        return last_spray(self.sprays, self.found.end.first)

    @property
    def days_since_spray(self) -> int | None:
        """From the last spray to the second of the two visits."""
        spray = self.last_spray
        return None if spray is None else (self.found.end.first - spray.sprayed_on).days


def outlook(
    block: BlockRecord,
    in_size_order: BlockRecord,
    between: tuple[date | None, date | None] = (None, None),
    plan: CropPlan | None = None,
    sprays: Sequence[SprayDay] = (),
    today: date | None = None,
) -> Outlook:
    """Between two visits, each named by a day of it; else of the newest visit against the one
    that it is best compared with. `in_size_order` is the block matched by size order alone;
    `today` is what the clock says, None where the block's days are made up.

    Raises BadInput where there are no such visits, or nothing grew between them.
    """
    interval = chosen_interval(block, *between)
    steps = trend(block)
    same = (each for each in steps if (each.start.first, each.end.first) == interval)
    found = next(same, None) or forecast(block, *interval)
    by_size_order = forecast(in_size_order, *interval)
    return Outlook(
        found,
        steps,
        by_size_order,
        None if plan is None else crop_forecast(found, plan),
        warnings_about(found, sprays, by_size_order, today),
        influences(found),
        tuple(sprays),
    )
