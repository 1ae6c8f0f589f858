"""What fieldcam uses of pupil-apriltags."""

import ctypes

import numpy as np
import numpy.typing as npt

class Detection:
    tag_family: bytes
    tag_id: int
    hamming: int
    decision_margin: float
    homography: npt.NDArray[np.float64]
    center: npt.NDArray[np.float64]
    corners: npt.NDArray[np.float64]

class Detector:
    libc: ctypes.CDLL
    tag_detector_ptr: object | None
    tag_families: dict[str, object]
    def __init__(
        self,
        families: str = ...,
        nthreads: int = ...,
        quad_decimate: float = ...,
        quad_sigma: float = ...,
        refine_edges: int = ...,
        decode_sharpening: float = ...,
        debug: int = ...,
    ) -> None: ...
    def __del__(self) -> None: ...
    def detect(self, img: npt.NDArray[np.uint8]) -> list[Detection]: ...
