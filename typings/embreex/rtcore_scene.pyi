from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

_Floats = npt.NDArray[np.float32]

class EmbreeScene:
    def __init__(self, device: object = ..., robust: bool = ...) -> None: ...
    @overload
    def run(
        self,
        vec_origins: _Floats,
        vec_directions: _Floats,
        dists: _Floats | float | None = ...,
        query: Literal["INTERSECT", "OCCLUDED"] = ...,
        output: Literal[False] | None = ...,
    ) -> npt.NDArray[Any]: ...
    @overload
    def run(
        self,
        vec_origins: _Floats,
        vec_directions: _Floats,
        dists: _Floats | float | None = ...,
        query: Literal["INTERSECT", "OCCLUDED"] = ...,
        *,
        output: Literal[True, 1],
    ) -> dict[str, npt.NDArray[Any]]: ...
