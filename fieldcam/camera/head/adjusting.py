"""Sets features by their SFNC names, reads them back, and says what a camera lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum, auto

from fieldcam.camera.genapi import (
    BooleanFeature,
    EnumerationFeature,
    FloatFeature,
    IntegerFeature,
    NodeMap,
)
from fieldcam.errors import CameraRefused, FeatureFileInvalid, FeatureMissing, FeatureRefused

Value = int | float | bool | str
CLOSE_ENOUGH = 0.01
"""Cameras round to steps of their clock; nobody sees a difference of this share."""


class Need(Enum):
    """What becomes of a capture where a feature cannot be set."""

    MUST = auto()
    """There can be none."""
    SHOULD = auto()
    """It is taken, and the operator told."""
    IF_THERE = auto()
    """Nobody misses the feature in a camera that has none."""


@dataclass(frozen=True, slots=True)
class Adjustment:
    """One feature as it should be."""

    name: str
    value: Value
    at: tuple[str, str] | None = None
    """The selector to set before, where the camera has it, and its entry."""
    need: Need = Need.SHOULD
    at_others: tuple[str, ...] = ()
    """Entries that serve as well where the camera does not offer the first: the standard
    leaves to it which it has."""

    @property
    def label(self) -> str:
        return self.name if self.at is None else f"{self.name}[{self.at[1]}]"


@dataclass(slots=True)
class Adjusted:
    """What became of adjustments."""

    values: dict[str, Value] = field(default_factory=dict)
    """As the camera gave them back, by label."""
    lacks: list[str] = field(default_factory=list)
    """A sentence for each thing that is not as it should be."""


def adjust(features: NodeMap, wanted: Sequence[Adjustment]) -> Adjusted:
    """Raises FeatureMissing, FeatureRefused or CameraRefused where a MUST cannot be set."""
    done = Adjusted()
    for each in wanted:
        if each.need is Need.IF_THERE and not has(features, each.name):
            continue
        try:
            found = _set(features, each)
        except (FeatureMissing, FeatureRefused, CameraRefused, FeatureFileInvalid) as error:
            if each.need is Need.MUST:
                raise
            lack = _at_its_line(each, error.message)
            done.lacks += [] if lack in done.lacks else [lack]
            continue
        done.values[each.label] = found
        if not _alike(found, each.value):
            done.lacks.append(f"{each.label} was set to {each.value} and is {found}.")
    return done


def has(features: NodeMap, name: str) -> bool:
    """Whether the camera has this feature, and it can be used now."""
    return name in features and features[name].available


def _at_its_line(wanted: Adjustment, sentence: str) -> str:
    """A camera has several of what is selected, and a sentence may name only the feature."""
    if wanted.at is None or wanted.at[1] in sentence:
        return sentence
    return f"{wanted.at[1]}: {sentence}"


def _set(features: NodeMap, wanted: Adjustment) -> Value:
    if wanted.at is not None and has(features, wanted.at[0]):
        features.enumeration(wanted.at[0]).value = _offered(features, wanted, *wanted.at)
    feature = features[wanted.name]
    if not feature.readable or not _alike(value_of(features, wanted.name), wanted.value):
        _write(features, wanted.name, wanted.value)
        feature.refresh()
    return value_of(features, wanted.name) if feature.readable else wanted.value


def _offered(features: NodeMap, wanted: Adjustment, selector: str, entry: str) -> str:
    offered = features.enumeration(selector).symbols
    return next((each for each in (entry, *wanted.at_others) if each in offered), entry)


def _write(features: NodeMap, name: str, value: Value) -> None:
    feature = features[name]
    if isinstance(feature, EnumerationFeature):
        feature.value = _on_off(value) if isinstance(value, bool) else str(value)
    elif isinstance(feature, BooleanFeature):
        feature.value = bool(value)
    elif isinstance(feature, FloatFeature):
        feature.value = float(value)
    elif isinstance(feature, IntegerFeature):
        feature.value = round(float(value))
    else:
        raise FeatureMissing(f"The camera's feature {name} takes no plain value.")


def value_of(features: NodeMap, name: str) -> Value:
    """What a plain feature holds; raises FeatureMissing or FeatureRefused."""
    feature = features[name]
    if isinstance(feature, EnumerationFeature | BooleanFeature | FloatFeature | IntegerFeature):
        return feature.value
    raise FeatureMissing(f"The camera's feature {name} has no plain value.")


def _alike(found: Value, wanted: Value) -> bool:
    if isinstance(found, str) or isinstance(wanted, str):
        return found == (_on_off(wanted) if isinstance(wanted, bool) else wanted)
    return abs(found - wanted) <= CLOSE_ENOUGH * abs(wanted)


def _on_off(value: bool) -> str:
    return "On" if value else "Off"
