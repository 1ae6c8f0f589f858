"""A picture of which a part is missing is to be taken again, whatever can be sized in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_evidence import codes, evidence
from test_analysis_work import FakePipeline, save

from fieldcam.analysis.messages import Setup
from fieldcam.analysis.work import VisionWork
from fieldcam.exchange.holes import has_hole, is_cut_short, torn_eyes
from fieldcam.values import Calibration, Expectation, ImageU8, StereoPair
from fieldcam.vision.pipeline import Pipeline

HEIGHT, WIDTH = 540, 720
CAMERA = Calibration(WIDTH, HEIGHT, 858.0, 360.0, 270.0, 60.0)


def night(channels: int = 3) -> ImageU8:
    """A lit spot before a sky that is quite black, as by flash; (H, W, 3) or (H, W)."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    light = 200 * np.exp(-((x - 360) ** 2 + (y - 300) ** 2) / 180**2) - 8
    picture = light[..., None] + rng.normal(0, 3, (HEIGHT, WIDTH, channels))
    image: ImageU8 = np.clip(picture, 0, 255).astype(np.uint8)
    return image if channels == 3 else image[..., 0]


def dark(channels: int, by: int, read_as_colour: bool = False) -> ImageU8:
    """A lit scene of which so many grey levels are cut off; with 40, 60 % of it is black."""
    rng = np.random.default_rng(5)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    light = 60 * np.exp(-((x - 360) ** 2 + (y - 270) ** 2) / 200**2)
    leaves = 15 * np.sin(x / 23 + 3 * np.sin(y / 31)) * np.sin(y / 17)
    picture = (light + leaves)[..., None] + rng.normal(0, 4, (HEIGHT, WIDTH, channels))
    image: ImageU8 = np.clip(picture + 20 - by, 0, 255).astype(np.uint8)
    if channels == 1:
        return np.repeat(image, 3, axis=2) if read_as_colour else image[..., 0]
    return image


NIGHTS = {
    f"{channels} channels, {'colour, ' if colour else ''}-{by}": dark(channels, by, colour)
    for channels, colour in ((1, False), (1, True), (3, False))
    for by in (0, 40)
}


def stored(image: ImageU8) -> ImageU8:
    """The values that lie in its file, to be damaged in place."""
    is_grey = image.ndim == 3 and bool((image == image[..., :1]).all())
    return (image[..., 0] if is_grey else image).copy()


def read_again(values: ImageU8, image: ImageU8) -> ImageU8:
    """As the reader gives them that gave the image."""
    return values if values.ndim == image.ndim else np.repeat(values[..., None], 3, axis=2)


@pytest.mark.parametrize("image", NIGHTS.values(), ids=NIGHTS)
def test_a_good_night_picture_is_whole(image: ImageU8) -> None:
    assert not has_hole(image)
    assert not is_cut_short(image)


def test_nights_are_as_black_as_real_ones() -> None:
    black = [float((image == 0).mean()) for image in NIGHTS.values()]
    assert 0.4 < max(black) < 0.7


@pytest.mark.parametrize("first", [180, 260, 340])
@pytest.mark.parametrize("image", NIGHTS.values(), ids=NIGHTS)
def test_rows_given_again_are_seen_by_night(image: ImageU8, first: int) -> None:
    torn = stored(image)
    torn[first : first + 60] = torn[first - 1]
    assert has_hole(read_again(torn, image))


@pytest.mark.parametrize("from_end", [False, True])
@pytest.mark.parametrize("share", [0.3, 0.45, 0.6, 0.7])
@pytest.mark.parametrize("image", NIGHTS.values(), ids=NIGHTS)
def test_a_lost_end_is_seen_by_night(image: ImageU8, share: float, from_end: bool) -> None:
    torn = stored(image)
    flat = torn.reshape(-1)
    at = int(flat.size * share) // 512 * 512 + 15
    flat[slice(at, None) if from_end else slice(None, at)] = 0
    assert is_cut_short(read_again(torn, image))


@pytest.mark.parametrize("kib", [4, 64])
@pytest.mark.parametrize(
    "fill", [b"\0", b"\xff", b"\x55\xaa", b"\xde\xad\xbe\xef", bytes(range(16))], ids=repr
)
@pytest.mark.parametrize("image", NIGHTS.values(), ids=NIGHTS)
def test_a_fill_that_comes_again_is_a_hole(image: ImageU8, fill: bytes, kib: int) -> None:
    torn = stored(image)
    flat = torn.reshape(-1)
    for share in (0.35, 0.5):
        at = int(flat.size * share) // 512 * 512 - 15
        kept = flat.copy()
        length = kib * 1024
        flat[at : at + length] = np.frombuffer(fill * (length // len(fill)), np.uint8)
        assert has_hole(read_again(torn, image))
        flat[:] = kept


def edged(rows: int, slope: float, value: int) -> ImageU8:
    """Over the picture's lower end lies something black or saturated, with a straight edge."""
    image = dark(3, 0)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    image[y > HEIGHT - rows + slope * x] = value
    return image


@pytest.mark.parametrize("value", [0, 255])
@pytest.mark.parametrize("slope", [1 / 200, 1 / 20, -1 / 200, 1 / 3])
def test_what_ends_aslant_is_no_hole(value: int, slope: float) -> None:
    assert not is_cut_short(edged(200, slope, value))
    assert not has_hole(edged(200, slope, value)[::-1])


@pytest.mark.parametrize("image", NIGHTS.values(), ids=NIGHTS)
def test_a_sensors_margin_by_night_is_none(image: ImageU8) -> None:
    for rows in (slice(None, 30), slice(-30, None)):
        margin = image[100:440].copy()
        margin[rows] = 0
        eyes = {"left": (Path("a.ppm"), margin)}
        assert torn_eyes(eyes) == ()


@pytest.fixture
def pipeline(monkeypatch: pytest.MonkeyPatch) -> FakePipeline:
    fake = FakePipeline()
    monkeypatch.setattr(Pipeline, "from_models", lambda models: fake)
    return fake


@pytest.mark.parametrize(("channels", "kib"), [(1, 4), (1, 64), (3, 4), (3, 64), (3, 256)])
@pytest.mark.parametrize("value", [0, 255, 90])
def test_a_run_of_one_value_is_a_hole(channels: int, value: int, kib: int) -> None:
    torn = night(channels)
    middle = torn.nbytes // 2 // 512 * 512
    torn.reshape(-1)[middle : middle + kib * 1024] = value
    assert has_hole(torn)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("from_end", [False, True])
def test_a_raw_image_without_its_beginning_or_end_is_cut_short(
    channels: int, from_end: bool
) -> None:
    torn = night(channels)
    flat = torn.reshape(-1)
    middle = flat.size // 2 // 512 * 512 + 15
    flat[slice(middle, None) if from_end else slice(None, middle)] = 0
    assert is_cut_short(torn)


@pytest.mark.parametrize("bayer", [False, True])
def test_rows_that_a_transfer_gave_again_are_a_hole(bayer: bool) -> None:
    torn = night(1)
    for row in range(300, 340):
        torn[row] = torn[298 + row % 2 if bayer else 299]
    assert has_hole(torn)


def white_card() -> ImageU8:
    image = night()
    image[200:400, 100:600] = 255
    return image


def upscaled() -> ImageU8:
    return np.repeat(np.repeat(night(1)[::2, ::2], 2, axis=0), 2, axis=1)


def drawn() -> ImageU8:
    image = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    image[100:300, 200:500] = (40, 160, 60)
    return image


@pytest.mark.parametrize(
    "whole",
    [night(1), night(3), white_card(), upscaled(), drawn(), np.zeros((HEIGHT, WIDTH), np.uint8)],
    ids=["grey", "colour", "white card", "upscaled", "drawn", "black"],
)
def test_a_whole_picture_has_no_hole(whole: ImageU8) -> None:
    assert not has_hole(whole)
    assert not is_cut_short(whole)


def test_the_black_margin_of_a_rectified_picture_is_none() -> None:
    margin = night()
    margin[:30] = 0
    eyes = {"left": (Path("a.png"), margin), "right": (Path("a.JPG"), margin)}
    assert torn_eyes(eyes) == ()
    assert torn_eyes({eye: (Path("a.ppm"), image) for eye, (_, image) in eyes.items()}) == ()
    margin.reshape(-1)[700_000:] = 0
    assert torn_eyes(eyes) == ()
    assert torn_eyes({"left": (Path("a.ppm"), night()), "right": (Path("b.PPM"), margin)}) == (
        "right",
    )


def test_a_stored_pair_says_which_eye_is_torn(tmp_path: Path, pipeline: FakePipeline) -> None:
    left = night()
    left.reshape(-1)[400_000 : 400_000 + 262_144] = 0
    saved = save(tmp_path, StereoPair(left, night()))
    VisionWork(Setup(CAMERA)).analyse(saved, Expectation(17))
    assert pipeline.seen[0][0].torn == ("left",)


def test_the_verdict_has_a_reason_of_its_own() -> None:
    assert codes(evidence()) == set()
    assert codes(evidence(torn=("left",))) == {"torn"}
    assert codes(evidence(torn=("left", "right"), fruitlets=())) == {"torn"}
