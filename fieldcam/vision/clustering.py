"""Which fruitlets grow from one bud: Algorithm 1 of the paper, section III-E.

Louvain communities of the fruitlets nearer than tau1, pairs merged into their
nearest community, the same again with tau2 for what is left over, then single
fruitlets added. Everything is worked in a fixed order of the centroids, so the
order of the input does not matter; centroids are computed anew after each
merge; a distance of exactly tau makes no edge; the seed is fixed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np
import numpy.typing as npt

Vectors = npt.NDArray[np.float64]
Community = tuple[int, ...]
TARGET_CAP_MM = 150.0
"""No fruitlet cluster further than this from the tag is the tagged one."""


@dataclass(frozen=True, slots=True)
class ClusterParameters:
    """Thresholds of Algorithm 1, with the authors' values but for `merge_mm`."""

    tau1_mm: float = 36.0
    tau2_mm: float = 50.0
    merge_mm: float = 38.0
    """d_c: members of a merged community lie nearer than this to its centroid.

    Tighter than the authors': of a neighbouring cluster often only two fruitlets
    can be seen, which 50 mm joins to the tagged one.
    """
    single_mm: float = 40.0
    """d_u: the same after a single fruitlet was added."""
    seed: int = 0


PAPER_CLUSTERS = ClusterParameters(merge_mm=50.0)


def clusters(
    centroids_mm: Vectors, parameters: ClusterParameters | None = None
) -> tuple[Community, ...]:
    """Group fruitlets by their centroids (N, 3); each is in one community at most."""
    parameters = parameters or ClusterParameters()
    points = np.asarray(centroids_mm, dtype=np.float64).reshape(-1, 3)
    order = np.lexsort(points.T[::-1])
    points = points[order]
    everyone = list(range(len(points)))
    groups = _communities(points, everyone, parameters.tau1_mm, parameters.seed)
    groups = _merge_pairs(points, groups, parameters.merge_mm)
    left = _unassigned(everyone, groups)
    groups += _communities(points, left, parameters.tau2_mm, parameters.seed)
    groups = _merge_pairs(points, groups, parameters.merge_mm)
    groups = _merge_singles(points, groups, everyone, parameters.single_mm)
    return tuple(sorted(tuple(sorted(int(order[i]) for i in group)) for group in groups))


def target_cluster(
    communities: Sequence[Community],
    centroids_mm: Vectors,
    tag_mm: Sequence[float],
    cap_mm: float = TARGET_CAP_MM,
) -> int | None:
    """Index of the tagged community: the one nearest the tag, if any is within the cap.

    Members are indices of `centroids_mm`, (N, 3); the tag is at (3,).

    "Nearest" is the mean of the distance to the community's centroid and the
    distance to its nearest fruitlet: the centroid alone favours small
    communities, the nearest fruitlet alone a neighbour's straggler.
    """
    if not communities:
        return None
    points = np.asarray(centroids_mm, dtype=np.float64)
    tag = np.asarray(tag_mm, dtype=np.float64)
    distances = [_tag_distance(points[list(c)], tag) for c in communities]
    best = int(np.argmin(distances))
    return best if distances[best] <= cap_mm else None


def with_singles(communities: Sequence[Community], certain: Sequence[int]) -> tuple[Community, ...]:
    """The communities and each unassigned one of the `certain` fruitlets as one of its own.

    A cluster that has dropped all but one fruitlet must not hand its tag to
    the next community; a doubtful detection beside the tag is no such fruitlet.
    """
    singles = _unassigned(certain, [list(c) for c in communities])
    return tuple(sorted([*communities, *((i,) for i in singles)]))


def rejoined(
    communities: Sequence[Community], centroids_mm: Vectors, merge_mm: float
) -> tuple[Community, ...]:
    """Communities of any size joined, nearest first, while their union fits one bud.

    Members, indices of `centroids_mm` (N, 3), of one bud lie nearer than `merge_mm` to their
    common centroid.

    Louvain splits large clusters of large fruitlets into halves of three or
    more, which the paper's merging of pairs does not mend. On 170 simulated
    clusters this raises the share of the tagged fruitlets that are found from
    0.88 to 0.95, with as few foreign ones.
    """
    points = np.asarray(centroids_mm, dtype=np.float64).reshape(-1, 3)
    groups = sorted(sorted(c) for c in communities)
    while True:
        centers = [points[g].mean(axis=0) for g in groups]
        candidates = [
            (float(np.linalg.norm(centers[i] - centers[j])), i, j)
            for j in range(len(groups))
            for i in range(j)
            if _compact(points, groups[i] + groups[j], merge_mm)
        ]
        if not candidates:
            return tuple(tuple(g) for g in groups)
        _, i, j = min(candidates)
        joint = sorted(groups[i] + groups[j])
        groups = sorted([g for k, g in enumerate(groups) if k not in (i, j)] + [joint])


def _tag_distance(members: Vectors, tag: Vectors) -> float:
    nearest = np.linalg.norm(members - tag, axis=1).min()
    return float(nearest + np.linalg.norm(members.mean(axis=0) - tag)) / 2


def _communities(
    points: Vectors, nodes: Sequence[int], tau_mm: float, seed: int
) -> list[list[int]]:
    """Louvain communities of at least two; a closer pair has a heavier edge."""
    graph: nx.Graph[int] = nx.Graph()
    for position, i in enumerate(nodes):
        for j in nodes[position + 1 :]:
            weight = 1.0 - float(np.linalg.norm(points[i] - points[j])) / tau_mm
            if weight > 0.0:
                graph.add_edge(i, j, weight=weight)
    if graph.number_of_edges() == 0:
        return []
    found = nx.community.louvain_communities(graph, weight="weight", seed=seed)
    return sorted(sorted(group) for group in found if len(group) > 1)


def _merge_pairs(points: Vectors, groups: Sequence[list[int]], limit_mm: float) -> list[list[int]]:
    """Join communities of two to their nearest one, the closest first (MergeCommunities)."""
    groups = list(groups)
    while (pair := _closest_pair(points, groups, limit_mm)) is not None:
        small, near = pair
        joint = sorted(groups[small] + groups[near])
        groups = sorted([g for k, g in enumerate(groups) if k not in pair] + [joint])
    return groups


def _closest_pair(
    points: Vectors, groups: Sequence[list[int]], limit_mm: float
) -> tuple[int, int] | None:
    """A community of two and its nearest, of those whose union is compact enough."""
    centers = [points[g].mean(axis=0) for g in groups]
    candidates = []
    for small, group in enumerate(groups):
        others = [k for k in range(len(groups)) if k != small]
        if len(group) > 2 or not others:
            continue
        near = min(others, key=lambda k: float(np.linalg.norm(centers[k] - centers[small])))
        if _compact(points, group + groups[near], limit_mm):
            candidates.append((float(np.linalg.norm(centers[near] - centers[small])), small, near))
    return min(candidates)[1:] if candidates else None


def _merge_singles(
    points: Vectors, groups: Sequence[list[int]], everyone: Sequence[int], limit_mm: float
) -> list[list[int]]:
    """Add unassigned fruitlets to communities, the nearest first (MergeUnassigned)."""
    groups = [list(g) for g in groups]
    while True:
        centers = [points[g].mean(axis=0) for g in groups]
        candidates = [
            (float(np.linalg.norm(points[i] - center)), i, k)
            for i in _unassigned(everyone, groups)
            for k, center in enumerate(centers)
            if _compact(points, [*groups[k], i], limit_mm)
        ]
        if not candidates:
            return groups
        _, single, group = min(candidates)
        groups[group] = sorted([*groups[group], single])


def _compact(points: Vectors, members: Sequence[int], limit_mm: float) -> bool:
    """Whether all members lie nearer than a limit to their common centroid."""
    chosen = points[list(members)]
    return bool((np.linalg.norm(chosen - chosen.mean(axis=0), axis=1) < limit_mm).all())


def _unassigned(everyone: Sequence[int], groups: Sequence[list[int]]) -> list[int]:
    taken = {i for group in groups for i in group}
    return [i for i in everyone if i not in taken]
