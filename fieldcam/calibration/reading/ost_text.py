"""`ost.txt`, as ROS's camera_calibration writes it: each eye's numbers under its name.

[image]                         [narrow_stereo/right]
width                           camera matrix
1440                            1716.0 0.0 732.9
...                             ...
"""

from __future__ import annotations

import re

from fieldcam.calibration.reading.yaml_entries import Entry

SECTION = re.compile(r"\[([^\[\]]{1,200})\]")
NAMES = {
    "width": "image_width",
    "height": "image_height",
    "camera matrix": "camera_matrix",
    "distortion": "distortion_coefficients",
    "rectification": "rectification_matrix",
    "projection": "projection_matrix",
}
"""What a CameraInfo calls the same."""


def is_ost(text: str) -> bool:
    return SECTION.search(text) is not None and "camera matrix" in text and "width" in text


def ost_eyes(text: str) -> dict[str, dict[str, Entry]]:
    """A CameraInfo's entries for each eye, by its name, such as `narrow_stereo/right`."""
    image: dict[str, Entry] = {}
    eyes: dict[str, dict[str, Entry]] = {}
    here, name = image, ""
    for line in text.splitlines():
        words = line.strip()
        if match := SECTION.fullmatch(words):
            if match[1] == "image":  # once for each eye
                here = image = {}
            else:
                here = eyes[match[1]] = image.copy()
            name = ""
        elif words.lower() in NAMES:
            name = NAMES[words.lower()]
        elif name and words and not words.startswith("#"):
            known = here.get(name)
            here[name] = [*(known if isinstance(known, list) else []), *words.split()]
    return eyes
