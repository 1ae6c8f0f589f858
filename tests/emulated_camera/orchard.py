"""The simulated orchard as what the emulated head looks at."""

from __future__ import annotations

from fieldcam.camera.simulated import OrchardProcess, SimulatedVisit

from .pictures import Image, mosaic


class Orchard:
    """A block on one day; a `PictureSource` that shows the cluster that it is aimed at."""

    def __init__(self, seed: int, clusters: int, day: int) -> None:
        self._process = OrchardProcess(seed, clusters)
        self._day = day
        self._index = -1
        self.tag_ids = self._process.row.tag_ids
        self.go_on()

    def __call__(self, ordinal: int) -> tuple[Image, Image]:
        return self._seen

    def go_on(self) -> int:
        """Aim at the next cluster, after the last at the first; gives its tag.

        Takes some seconds to render; until then the old one is seen.
        """
        self._index = (self._index + 1) % len(self.tag_ids)
        pair = self._process.picture(SimulatedVisit(self._index, self._day))
        self._seen = mosaic(pair.left), mosaic(pair.right)
        return self.tag_ids[self._index]

    def close(self) -> None:
        self._process.close()
