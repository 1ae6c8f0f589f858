"""Takes pairs with the head that this process sees over libusb, and prints how it went.

python tests/head_rate.py DATA SECONDS
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np

from fieldcam.camera.finding import HeadFinder

RATE_HZ = 30
DEADLINE_S = 2.0


def main(data: Path, seconds: float) -> None:
    """Pairs at RATE_HZ, each by a trigger of its own."""
    took_ms = []
    with HeadFinder(data).open() as head:
        exposure_ms = 0.3
        head.capture(DEADLINE_S)
        started_s = time.monotonic()
        for due in range(int(seconds * RATE_HZ)):
            time.sleep(max(0.0, started_s + due / RATE_HZ - time.monotonic()))
            before_s = time.monotonic()
            pair = head.capture(DEADLINE_S)
            took_ms.append((time.monotonic() - before_s) * 1000 - exposure_ms)
            assert pair.trigger_ordinal == due + 2
        total_s = time.monotonic() - started_s
    middle, high, worst = np.percentile(took_ms, [50, 99, 100])
    found = {"rate_hz": len(took_ms) / total_s, "ms": [middle, high, worst]}
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]))
