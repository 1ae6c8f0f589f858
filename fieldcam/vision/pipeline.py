"""One stereo pair in, one reading out: the stages in their order (paper Fig. 2a)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING, Self

import numpy as np

from fieldcam import __version__
from fieldcam.values import (
    Calibration,
    ClusterReading,
    DisparityWindow,
    Expectation,
    Instance,
    Matcher,
    Method,
    Region,
    Settings,
    StereoPair,
    TagPose,
)
from fieldcam.vision.clouds import PAPER_CLOUDS, CloudParameters, FruitletCloud, fruitlet_cloud
from fieldcam.vision.clustering import (
    PAPER_CLUSTERS,
    ClusterParameters,
    Community,
    clusters,
    rejoined,
    target_cluster,
    with_singles,
)
from fieldcam.vision.fruitlets import as_trusted, make_fruitlet
from fieldcam.vision.judging.doubt import unsure_places
from fieldcam.vision.judging.evidence import Evidence
from fieldcam.vision.judging.quality import measure_quality
from fieldcam.vision.judging.verdicts import judge
from fieldcam.vision.regions import around_tag
from fieldcam.vision.segmentation import Segmentation, Segmenter, is_cut
from fieldcam.vision.sizing.covers import covers
from fieldcam.vision.sizing.diameters import (
    Observation,
    SizedOutline,
    size_by_paper,
    size_fruitlet,
)
from fieldcam.vision.sizing.parameters import SizingParameters, Uncertainty
from fieldcam.vision.stereo.matching import (
    StereoMatcher,
    default_max_disparity,
    match_coarse,
    match_region,
    match_whole,
)
from fieldcam.vision.stereo.raft import RaftMatcher
from fieldcam.vision.stereo.sgbm import SgbmMatcher
from fieldcam.vision.tags.detection import choose_tag, detect_tags
from fieldcam.vision.tags.other_families import other_family
from fieldcam.vision.tags.right_eye import TagReader, find_in_right

if TYPE_CHECKING:
    from fieldcam.models import Models


@dataclass(frozen=True, slots=True)
class Parameters:
    """Thresholds of the stages that have some."""

    clouds: CloudParameters = field(default_factory=CloudParameters)
    clustering: ClusterParameters = field(default_factory=ClusterParameters)
    sizing: SizingParameters = field(default_factory=SizingParameters)


class Pipeline:
    """Sizes tagged clusters; holds the two networks and nothing about any capture."""

    def __init__(
        self,
        segmenter: Segmentation,
        matchers: Mapping[Matcher, StereoMatcher],
        models: Mapping[str, str] | None = None,
        parameters: Parameters | None = None,
        read_tags: TagReader = detect_tags,
    ) -> None:
        self._segmenter = segmenter
        self._matchers = matchers
        self._models = dict(models or {})
        self._parameters = parameters or Parameters()
        self._read_tags = read_tags

    @classmethod
    def from_models(cls, models: Models) -> Self:
        """The pipeline on the networks of an installation."""
        segmentation, stereo = models.segmentation, models.stereo
        scale = float(segmentation.facts.get("scale", 1.0))
        bias = float(segmentation.facts.get("edge_bias_px", 0.0))
        uncertainty = Uncertainty(**segmentation.facts.get("uncertainty", {}))
        return cls(
            Segmenter(segmentation.path, segmentation.score_threshold, scale),
            {
                Matcher.RAFT: RaftMatcher.from_file(
                    stereo.path, stereo.search_px, stereo.multiple, stereo.scale
                ),
                Matcher.SGBM: SgbmMatcher(),
            },
            models.hashes,
            Parameters(sizing=SizingParameters(uncertainty=uncertainty, edge_bias_px=bias)),
        )

    def analyse(
        self,
        pair: StereoPair,
        calibration: Calibration,
        expectation: Expectation | None = None,
        settings: Settings | None = None,
    ) -> ClusterReading:
        """Everything that one pair says about the cluster beside its tag."""
        expectation, settings = expectation or Expectation(), settings or Settings()
        clock = _Clock()
        with clock.stage("total"):
            return self._analyse(pair, calibration, expectation, settings, clock)

    def _analyse(
        self,
        pair: StereoPair,
        calibration: Calibration,
        expectation: Expectation,
        settings: Settings,
        clock: _Clock,
    ) -> ClusterReading:
        with clock.stage("tags"):
            tags = self._read_tags(pair.left, calibration, settings.tag_size_mm)
            tag = choose_tag(tags, expectation.tag_id, pair.size_px)
            right_tag = find_in_right(self._read_tags, pair.right, tag, calibration)
        region = _region(pair, tag, calibration, settings)
        with clock.stage("segmentation"):
            segmented = self._segmenter.segment(pair.left, region)
            instances = segmented.instances
        with clock.stage("stereo"):
            window = self._match(pair, region, tag, calibration, settings)
        with clock.stage("clouds"):
            clouds = self._clouds(instances, window, calibration, settings)
        with clock.stage("clustering"):
            groups, target = self._cluster(instances, clouds, tag, settings)
        with clock.stage("sizing"):
            sizes = self._sizes(instances, clouds, window, calibration, settings)
        fruitlets = tuple(
            make_fruitlet(k, instance, cloud, size, calibration, groups, target)
            for k, (instance, cloud, size) in enumerate(zip(instances, clouds, sizes, strict=True))
        )
        with clock.stage("judge"):
            quality = measure_quality(pair, region, tag, window, fruitlets)
            evidence = Evidence(
                tag, right_tag, tags, expectation, fruitlets, segmented.faint_px, window,
                calibration, region, quality, settings.tag_size_mm, pair.torn,
                "" if tags else other_family(pair.left),
            )  # fmt: skip
            unsure_px = unsure_places(evidence)
            verdict = judge(evidence, unsure_px)
        return ClusterReading(
            tag=tag,
            tags_seen=tuple(t.id for t in tags),
            fruitlets=as_trusted(fruitlets, verdict),
            verdict=verdict,
            window=window,
            faint_px=segmented.faint_px,
            unsure_px=unsure_px,
            tag_size_error=evidence.tag_size_error,
            calibration=calibration,
            settings=settings,
            expectation=expectation,
            timing_ms=clock.timing_ms,
            models=self._models,
            software_version=__version__,
        )

    def _match(
        self,
        pair: StereoPair,
        region: Region,
        tag: TagPose | None,
        calibration: Calibration,
        settings: Settings,
    ) -> DisparityWindow:
        matcher = self._matchers[settings.stereo]
        bound = default_max_disparity(pair.size_px[0])
        offset = None
        if tag is not None and tag.range_mm is not None:
            offset = round(calibration.disparity_px(tag.range_mm))
        if settings.whole_image or settings.method is Method.PAPER:
            return match_whole(pair, matcher, bound, offset)
        if offset is None:
            return match_coarse(pair, matcher, bound)
        return match_region(pair, region, offset, matcher)

    def _clouds(
        self,
        instances: Sequence[Instance],
        window: DisparityWindow,
        calibration: Calibration,
        settings: Settings,
    ) -> list[FruitletCloud]:
        paper = settings.method is Method.PAPER
        parameters = PAPER_CLOUDS if paper else self._parameters.clouds
        return [fruitlet_cloud(i.visible, window, calibration, parameters) for i in instances]

    def _cluster(
        self,
        instances: Sequence[Instance],
        clouds: Sequence[FruitletCloud],
        tag: TagPose | None,
        settings: Settings,
    ) -> tuple[tuple[Community, ...], Community]:
        """Communities of fruitlets, by their indices, and the tagged one (empty if none)."""
        placed = [(k, c.centroid_mm) for k, c in enumerate(clouds) if c.centroid_mm is not None]
        centroids = np.array([c for _, c in placed], dtype=np.float64).reshape(-1, 3)
        paper = settings.method is Method.PAPER
        parameters = PAPER_CLUSTERS if paper else self._parameters.clustering
        found = clusters(centroids, parameters)
        if not paper:
            certain = self._parameters.sizing.min_score
            sure = [n for n, (k, _) in enumerate(placed) if instances[k].score >= certain]
            found = with_singles(found, sure)
            found = rejoined(found, centroids, parameters.merge_mm)
        groups = tuple(tuple(placed[i][0] for i in group) for group in found)
        if tag is None or tag.translation_mm is None:
            return groups, ()
        best = target_cluster(found, centroids, tag.translation_mm)
        return groups, () if best is None else groups[best]

    def _sizes(
        self,
        instances: Sequence[Instance],
        clouds: Sequence[FruitletCloud],
        window: DisparityWindow,
        calibration: Calibration,
        settings: Settings,
    ) -> list[SizedOutline]:
        before = covers(instances, clouds, window, calibration)
        observed = [
            Observation(instance, window, cloud.known, cover, is_cut(instance, window.region))
            for instance, cloud, cover in zip(instances, clouds, before, strict=True)
        ]
        if settings.method is Method.PAPER:
            return [size_by_paper(o, calibration) for o in observed]
        return [size_fruitlet(o, calibration, self._parameters.sizing) for o in observed]


class _Clock:
    """Wall-clock time of each stage."""

    def __init__(self) -> None:
        self.timing_ms: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        start = perf_counter()
        try:
            yield
        finally:
            self.timing_ms[name] = (perf_counter() - start) * 1000


def _region(
    pair: StereoPair, tag: TagPose | None, calibration: Calibration, settings: Settings
) -> Region:
    if tag is None or settings.whole_image or settings.method is Method.PAPER:
        return Region.whole(*pair.size_px)
    return around_tag(tag, calibration, *pair.size_px)
