"""fieldcam: sizes of tagged apple fruitlet clusters from a flash stereo camera."""

import os
from datetime import date

# onnxruntime 1.29 and later write a device's id into the home folder and send usage
# data, unless this is set before it is loaded (microsoft/onnxruntime#27379).
os.environ["ORT_DISABLE_TELEMETRY"] = "1"

__version__ = "0.1.0"

RELEASED = date(2026, 5, 1)
"""Raised with the version: no clock that is right says an earlier day while this one runs."""
