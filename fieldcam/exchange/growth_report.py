"""A block's forecast as the JSON document of `fieldcam growth --json`."""

from __future__ import annotations

from collections.abc import Sequence

from fieldcam.exchange.json_form import Json
from fieldcam.growth.crop import CropForecast
from fieldcam.growth.forecast import Forecast, FruitletForecast
from fieldcam.growth.influence import ClusterInfluence
from fieldcam.growth.outlook import Outlook
from fieldcam.growth.resampling import Interval
from fieldcam.growth.warnings.doubts import is_doubtful


def growth_report(growth: Outlook, notes: Sequence[str]) -> Json:
    """The binding fields first, then what else is known; dates as YYYY-MM-DD.

    `notes` are what was assumed, a sentence each.
    """
    found = growth.found
    counts, reference = found.counts, found.reference
    return {
        "block": found.block.name,
        "from": str(found.start.first),
        "to": str(found.end.first),
        "days": found.days,
        "reference": {
            "n": reference.n,
            "rate_mm_per_day": reference.rate_mm_per_day,
            "measured_mm_per_day": reference.measured_mm_per_day,
            "corrected_mm_per_day": reference.corrected_mm_per_day,
        },
        "cutoff_mm_per_day": reference.cutoff_mm_per_day,
        "initial": counts.initial,
        "persist": counts.persist,
        "abscise": counts.abscise,
        "fallen": counts.fallen,
        "not_seen": counts.not_seen,
        "set_pct_of_initial": found.set_pct,
        "interval90_pct": list(found.interval90_pct),
        "interval90_trees_pct": _interval(found.interval90_trees_pct),
        "warnings": [{"code": each.code, "text": each.text} for each in growth.warnings],
        "notes": list(notes),
        "measured_by": found.block.source,
        "from_days": [str(day) for day in found.start.days],
        "to_days": [str(day) for day in found.end.days],
        "ignored": found.ignored,
        "crop": None if growth.crop is None else _crop(growth.crop),
        "days_since_spray": growth.days_since_spray,
        "sprays": [{"date": str(s.sprayed_on), "product": s.product} for s in growth.sprays],
        "by_size_order": _set(growth.by_size_order),
        "trend": [_step(each) for each in growth.trend],
        "clusters": [_cluster(each) for each in growth.clusters],
        "fruitlets": [_fruitlet(each) for each in found.fruitlets],
    }


def _crop(crop: CropForecast) -> Json:
    return {
        "bloom_clusters_per_tree": crop.plan.bloom_clusters,
        "target_fruit_per_tree": crop.plan.target_fruit,
        "fruit_per_tree": crop.fruit,
        "interval90_fruit_per_tree": _interval(crop.interval90_fruit),
        "fruit_per_tree_by_potential": crop.fruit_by_potential,
        "verdict": crop.verdict,
    }


def _step(found: Forecast) -> Json:
    return {"from": str(found.start.first), "to": str(found.end.first), **_set(found)}


def _set(found: Forecast) -> Json:
    return {
        "set_pct_of_initial": found.set_pct,
        "interval90_pct": list(found.interval90_pct),
        "interval90_trees_pct": _interval(found.interval90_trees_pct),
    }


def _interval(interval: Interval | None) -> list[float] | None:
    return None if interval is None else list(interval)


def _cluster(cluster: ClusterInfluence) -> Json:
    counts = cluster.counts
    return {
        "tag": cluster.tag_id,
        "tree": cluster.tree,
        "initial": counts.initial,
        "persist": counts.persist,
        "abscise": counts.abscise,
        "fallen": counts.fallen,
        "not_seen": counts.not_seen,
        "influence_points": cluster.influence_points,
    }


def _fruitlet(each: FruitletForecast) -> Json:
    return {
        "tag": each.fruitlet.tag_id,
        "fruitlet": each.fruitlet.fruitlet,
        "sizes_mm": {str(day): mm for day, mm in each.sizes_mm.items()},
        "rate_mm_per_day": each.rate_mm_per_day,
        "state": each.state,
        "doubts": list(each.doubts),
        "certainty": {
            str(day): seen.confidence for day, seen in each.fruitlet.seen_on if is_doubtful(seen)
        },
        "sds_mm": {str(day): mm for day, mm in each.sds_mm.items()},
    }
