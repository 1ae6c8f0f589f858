"""From light to an 8-bit picture: lens, exposure, noise, Bayer filter, tone curve."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from fieldcam.images.pixels import mosaic
from fieldcam.simulator.mesh import F32
from fieldcam.values import ImageU8, PixelFormat


@dataclass(frozen=True, slots=True)
class Sensor:
    """What both eyes share in one exposure."""

    exposure: float
    gamma: float
    white_balance: tuple[float, float, float]
    lens_blur_px: float
    """Gaussian sigma of the lens in focus."""
    defocus_px: float
    """Extra sigma for each 10 % that a point is away from the focused range."""
    focus_mm: float
    shake_px: float
    shake_rad: float
    shot_noise: float
    read_noise: float
    bayer: bool
    vignetting: float
    dirt: float
    seed: int

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Sensor:
        """Draw an ordinary exposure of the flash camera."""
        tint = np.exp(rng.normal(0, 0.08, 3))
        return cls(
            exposure=float(rng.lognormal(0.3, 0.3)),
            gamma=float(rng.uniform(1.7, 2.4)),
            white_balance=(float(tint[0]), float(tint[1]), float(tint[2])),
            lens_blur_px=float(rng.uniform(0.35, 0.85)),
            defocus_px=float(rng.uniform(0.1, 0.5)),
            focus_mm=float(rng.uniform(400, 480)),
            shake_px=float(rng.choice([0.0, rng.uniform(0, 1.5)], p=[0.7, 0.3])),
            shake_rad=float(rng.uniform(0, np.pi)),
            shot_noise=float(rng.uniform(0.002, 0.02)),
            read_noise=float(rng.uniform(0.001, 0.006)),
            bayer=bool(rng.random() < 0.7),
            vignetting=float(rng.uniform(0, 0.35)),
            dirt=float(rng.choice([0.0, rng.uniform(0, 0.25)], p=[0.7, 0.3])),
            seed=int(rng.integers(1, 2**31)),
        )

    def other_eye(self) -> Sensor:
        """The second eye: nearly the same exposure, other noise and vignetting."""
        rng = np.random.default_rng([self.seed, 1])
        return replace(
            self,
            exposure=self.exposure * float(np.exp(rng.normal(0, 0.05))),
            vignetting=self.vignetting * float(rng.uniform(0.7, 1.3)),
            lens_blur_px=self.lens_blur_px * float(rng.uniform(0.9, 1.15)),
            dirt=self.dirt * float(rng.uniform(0, 1.5)),
            seed=self.seed + 1,
        )

    def expose(self, radiance: F32, depth_mm: F32, center_px: tuple[float, float]) -> ImageU8:
        """Picture (h, w, 3) of a window; `center_px` is the image centre in the window."""
        rng = np.random.default_rng(self.seed)
        light = self._through_lens(radiance, depth_mm)
        light *= (self.exposure * self._falloff((light.shape[0], light.shape[1]), center_px))[
            ..., None
        ]
        if self.dirt > 0:
            light *= _smudges(rng, (light.shape[0], light.shape[1]), self.dirt)[..., None]
        light *= np.asarray(self.white_balance, np.float32)
        noise = rng.standard_normal(light.shape, dtype=np.float32)
        light += noise * np.sqrt(self.shot_noise * 0.05 * np.clip(light, 0, 1) + self.read_noise**2)
        picture = np.clip(light, 0, 1) ** (1 / self.gamma) * 255
        quantised = np.round(picture).astype(np.uint8)
        return _demosaiced(quantised) if self.bayer else quantised

    def _through_lens(self, radiance: F32, depth_mm: F32) -> F32:
        sharp = cv2.GaussianBlur(radiance, (0, 0), self.lens_blur_px)
        finite = np.where(np.isfinite(depth_mm), depth_mm, 5000.0)
        away = np.abs(self.focus_mm / finite - 1) * 10 * self.defocus_px
        soft = cv2.GaussianBlur(radiance, (0, 0), self.lens_blur_px + 1.8)
        blurred = cv2.GaussianBlur(np.clip(away / 1.8, 0, 1).astype(np.float32), (0, 0), 2.0)
        share = np.asarray(blurred, np.float32)[..., None]
        mixed = sharp * (1 - share) + soft * share
        if self.shake_px > 0.3:
            mixed = cv2.filter2D(mixed, -1, _streak(self.shake_px, self.shake_rad))
        return np.ascontiguousarray(mixed, dtype=np.float32)

    def _falloff(self, shape: tuple[int, int], center_px: tuple[float, float]) -> F32:
        rows, columns = np.ogrid[: shape[0], : shape[1]]
        squared = ((columns - center_px[0]) ** 2 + (rows - center_px[1]) ** 2) / 900.0**2
        return np.asarray(1 - self.vignetting * np.clip(squared, 0, 1.5), np.float32)


def _streak(length_px: float, angle_rad: float) -> F32:
    """A line-shaped kernel for a camera that moved during the flash."""
    half = int(np.ceil(length_px)) + 1
    rows, columns = np.mgrid[-half : half + 1, -half : half + 1]
    along = columns * np.cos(angle_rad) + rows * np.sin(angle_rad)
    across = -columns * np.sin(angle_rad) + rows * np.cos(angle_rad)
    kernel = np.exp(-((across / 0.5) ** 2)) * (np.abs(along) <= max(length_px, 1) / 2 + 0.5)
    return np.asarray(kernel / kernel.sum(), np.float32)


def _smudges(rng: np.random.Generator, shape: tuple[int, int], strength: float) -> F32:
    """Soft spots of dirt on the window in front of the lens."""
    coarse = rng.normal(0, 1, (7, 9)).astype(np.float32)
    spots = cv2.resize(coarse, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return np.asarray(1 - strength * np.clip(spots - 0.6, 0, 1), np.float32)


def _demosaiced(picture: ImageU8) -> ImageU8:
    """What a colour filter array and its interpolation leave of a picture."""
    raw = mosaic(picture, PixelFormat.BAYER_RG8)
    return np.asarray(cv2.cvtColor(raw, cv2.COLOR_BayerRGGB2RGB), np.uint8)
