import numpy as np
import numpy.typing as npt
from embreex.rtcore_scene import EmbreeScene

class TriangleMesh:
    def __init__(
        self,
        scene: EmbreeScene,
        vertices: npt.NDArray[np.float32],
        indices: npt.NDArray[np.integer] | None = ...,
    ) -> None: ...
