from collections.abc import Hashable
from typing import TypeVar

from networkx import Graph

_Node = TypeVar("_Node", bound=Hashable)

def louvain_communities(
    G: Graph[_Node],
    weight: str | None = ...,
    resolution: float = ...,
    threshold: float = ...,
    max_level: int | None = ...,
    seed: int | None = ...,
) -> list[set[_Node]]: ...
def modularity(
    G: Graph[_Node], communities: list[set[_Node]], weight: str | None = ...
) -> float: ...
