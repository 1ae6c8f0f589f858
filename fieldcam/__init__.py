"""fieldcam: sizes of tagged apple fruitlet clusters from a flash stereo camera."""

import os

# onnxruntime 1.29 and later write a device's id into the home folder and send usage
# data, unless this is set before it is loaded (microsoft/onnxruntime#27379).
os.environ["ORT_DISABLE_TELEMETRY"] = "1"

__version__ = "0.1.0"
