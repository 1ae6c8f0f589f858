"""GenApi: a camera's features by name, from the feature file (GenICam XML) that it brings.

Neutral to the transport: `NodeMap` needs only something that reads and writes
registers. Written from the public schema and from what cameras' files hold; where
they leave a choice, the standard's reference implementation decides, but for the
precedence of operators (see `formula`).
"""

from fieldcam.camera.genapi.access import Access, Visibility
from fieldcam.camera.genapi.feature import Feature
from fieldcam.camera.genapi.feature_file import FeatureFile, load_feature_file, plain_xml
from fieldcam.camera.genapi.features import (
    BooleanFeature,
    CategoryFeature,
    CommandFeature,
    EnumEntry,
    EnumerationFeature,
    RegisterFeature,
    StringFeature,
)
from fieldcam.camera.genapi.listing import Entry, declared_entries, present_entries
from fieldcam.camera.genapi.node_map import NodeMap
from fieldcam.camera.genapi.number_features import FloatFeature, IntegerFeature
from fieldcam.camera.genapi.registers import NoCamera, Registers

__all__ = [
    "Access",
    "BooleanFeature",
    "CategoryFeature",
    "CommandFeature",
    "Entry",
    "EnumEntry",
    "EnumerationFeature",
    "Feature",
    "FeatureFile",
    "FloatFeature",
    "IntegerFeature",
    "NoCamera",
    "NodeMap",
    "RegisterFeature",
    "Registers",
    "StringFeature",
    "Visibility",
    "declared_entries",
    "load_feature_file",
    "plain_xml",
    "present_entries",
]
