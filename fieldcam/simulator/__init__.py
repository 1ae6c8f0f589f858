"""The simulated orchard: tagged clusters over days, rendered with full truth.

For the demo, for tests, and to train the networks on. Needs the `simulator`
extra (Embree). Everything follows from seeds.
"""

from fieldcam.simulator.capture import SimulatedCapture, calibration_of, capture
from fieldcam.simulator.faults import Faults, Spoiling
from fieldcam.simulator.plan import BlockPlan, ClusterPlan, FruitletPlan, Variety
from fieldcam.simulator.truth import TrueFruitlet, Truth

__all__ = [
    "BlockPlan",
    "ClusterPlan",
    "Faults",
    "FruitletPlan",
    "SimulatedCapture",
    "Spoiling",
    "TrueFruitlet",
    "Truth",
    "Variety",
    "calibration_of",
    "capture",
]
