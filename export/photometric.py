"""Changes of light, colour and sharpness for training crops; geometry stays as it is."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

ImageU8 = npt.NDArray[np.uint8]
"""(H, W, 3) RGB."""
FloatMask = npt.NDArray[np.float32]


def _chance(rng: np.random.Generator, share: float) -> bool:
    return bool(rng.random() < share)


def tint_fruit(image: ImageU8, fruit: FloatMask, rng: np.random.Generator) -> ImageU8:
    """Hue, saturation and brightness of the fruit alone; `fruit` is (H, W) 0 to 1."""
    hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV).astype(np.int16)
    hsv[..., 0] = (hsv[..., 0] + int(rng.normal(0, 9))) % 180
    hsv[..., 1] = np.clip(hsv[..., 1] * rng.uniform(0.45, 1.6) + rng.normal(0, 10), 0, 255)
    hsv[..., 2] = np.clip(hsv[..., 2] * rng.uniform(0.75, 1.3), 0, 255)
    tinted = cv2.cvtColor(hsv.astype(np.uint8), cv2.COLOR_HSV2RGB)
    share = fruit[..., None]
    return (image * (1 - share) + tinted * share).astype(np.uint8)


def _tone_table(rng: np.random.Generator) -> npt.NDArray[np.uint8]:
    """(256, 3) curve of each channel: cast, gamma, brightness, contrast."""
    levels = np.linspace(0, 1, 256, dtype=np.float32)[:, None]
    cast = np.exp(rng.normal(0, 0.13, 3))
    gamma = np.exp(rng.normal(0, 0.28)) * np.exp(rng.normal(0, 0.05, 3))
    gain = np.exp(rng.normal(0, 0.22))
    contrast = np.exp(rng.normal(0, 0.2))
    lift = rng.normal(0, 0.04)
    curve = (levels**gamma * cast * gain - 0.4) * contrast + 0.4 + lift
    return np.asarray(np.clip(curve * 255.0, 0, 255), dtype=np.uint8)


def _tone(image: ImageU8, rng: np.random.Generator) -> ImageU8:
    table = _tone_table(rng)
    channels = [cv2.LUT(np.ascontiguousarray(image[..., c]), table[:, c]) for c in range(3)]
    toned = np.stack(channels, axis=-1)
    if _chance(rng, 0.12):
        grey = cv2.cvtColor(toned, cv2.COLOR_RGB2GRAY)[..., None].astype(np.float32)
        toned = (toned + (grey - toned) * rng.uniform(0.3, 1.0)).astype(np.uint8)
    return np.asarray(toned, dtype=np.uint8)


def _uneven_light(image: ImageU8, rng: np.random.Generator) -> ImageU8:
    """Smooth light and dark patches, as from sun through leaves."""
    cells = int(rng.integers(2, 8))
    field = np.exp(rng.normal(0, rng.uniform(0.1, 0.5), (cells, cells))).astype(np.float32)
    size = (image.shape[1], image.shape[0])
    light = cv2.resize(field, size, interpolation=cv2.INTER_CUBIC)
    return np.asarray(np.clip(image * light[..., None], 0, 255), dtype=np.uint8)


def _hard_shadow(image: ImageU8, rng: np.random.Generator) -> ImageU8:
    height, width = image.shape[:2]
    corners = rng.uniform(-0.2, 1.2, (int(rng.integers(3, 6)), 2)) * (width, height)
    shade = np.zeros((height, width), np.uint8)
    cv2.fillPoly(shade, [corners.astype(np.int32)], 255)
    soft = cv2.GaussianBlur(shade, (0, 0), float(rng.uniform(0.8, 4.0))).astype(np.float32) / 255
    light = 1.0 - soft * rng.uniform(0.2, 0.65)
    return (image * light[..., None]).astype(np.uint8)


def _motion_kernel(rng: np.random.Generator) -> npt.NDArray[np.float32]:
    length = int(rng.integers(3, 8))
    kernel = np.zeros((length, length), np.float32)
    angle = rng.uniform(0, np.pi)
    centre = (length - 1) / 2
    for step in np.linspace(-centre, centre, 4 * length):
        row, column = centre + step * np.sin(angle), centre + step * np.cos(angle)
        kernel[round(row), round(column)] = 1.0
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)


def _soften(image: ImageU8, rng: np.random.Generator) -> ImageU8:
    if _chance(rng, 0.15):
        blurred = cv2.filter2D(image, -1, _motion_kernel(rng))
    else:
        blurred = cv2.GaussianBlur(image, (0, 0), float(rng.uniform(0.4, 1.8)))
    return np.asarray(blurred, dtype=np.uint8)


def _sharpen(image: ImageU8, rng: np.random.Generator) -> ImageU8:
    soft = cv2.GaussianBlur(image, (0, 0), 1.0)
    amount = float(rng.uniform(0.3, 1.2))
    sharper = cv2.addWeighted(image, 1 + amount, soft, -amount, 0)
    return np.asarray(sharper, dtype=np.uint8)


def _noise(image: ImageU8, rng: np.random.Generator) -> ImageU8:
    height, width = image.shape[:2]
    grain = rng.standard_normal((height, width, 3), dtype=np.float32)
    if _chance(rng, 0.3):
        grain = cv2.GaussianBlur(grain, (0, 0), 0.7) * 1.8
    level = float(np.exp(rng.normal(1.2, 0.7)))
    return np.clip(image + grain * level, 0, 255).astype(np.uint8)


def _jpeg(image: ImageU8, rng: np.random.Generator) -> ImageU8:
    quality = int(rng.integers(35, 96))
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise ValueError("the crop could not be encoded as JPEG")
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)


def jitter(image: ImageU8, fruit: FloatMask, rng: np.random.Generator) -> ImageU8:
    """A crop under other light, through another camera."""
    for share, change in (
        (0.35, lambda i, r: tint_fruit(i, fruit, r)),
        (0.25, _uneven_light),
        (0.2, _hard_shadow),
        (0.85, _tone),
        (0.35, _soften),
        (0.1, _sharpen),
        (0.6, _noise),
        (0.25, _jpeg),
    ):
        if _chance(rng, share):
            image = change(image, rng)
    return image
