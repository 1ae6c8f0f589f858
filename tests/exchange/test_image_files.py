"""Images are read whole or refused in one sentence."""

from __future__ import annotations

import struct
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fieldcam.errors import BadInput, ImageUnreadable, PairMismatch
from fieldcam.exchange.images import check_against, read_image, read_pair, write_png
from fieldcam.values import Calibration

RGB = np.random.default_rng(1).integers(0, 256, (24, 32, 3), dtype=np.uint8)
GREY = RGB[..., 1].copy()
GREY_AS_RGB = np.repeat(GREY[..., None], 3, axis=2)


def encode(suffix: str, image: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]) -> bytes:
    stored = image[..., [2, 1, 0, 3][: image.shape[2]]] if image.ndim == 3 else image
    return cv2.imencode(suffix, stored)[1].tobytes()


def saved(folder: Path, content: bytes, name: str = "image.png") -> Path:
    path = folder / name
    path.write_bytes(content)
    return path


ALPHA = np.full((24, 32, 1), 3, np.uint8)


@pytest.mark.parametrize(
    ("suffix", "image", "expected"),
    [
        (".png", RGB, RGB),
        (".png", GREY, GREY_AS_RGB),
        (".png", np.concatenate((RGB, ALPHA), axis=2), RGB),
        (".ppm", RGB, RGB),
        (".pgm", GREY, GREY_AS_RGB),
    ],
)
def test_lossless_images_come_back_as_rgb(
    tmp_path: Path,
    suffix: str,
    image: npt.NDArray[np.uint8],
    expected: npt.NDArray[np.uint8],
) -> None:
    found = read_image(saved(tmp_path, encode(suffix, image)))
    assert found.dtype == np.uint8 and np.array_equal(found, expected)


@pytest.mark.parametrize("options", [[], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]])
def test_jpegs_come_back_nearly_unchanged(tmp_path: Path, options: list[int]) -> None:
    smooth = cv2.GaussianBlur(RGB, (0, 0), 4)
    quality = [cv2.IMWRITE_JPEG_QUALITY, 98, *options]
    content = cv2.imencode(".jpg", smooth[..., ::-1], quality)[1].tobytes()
    found = read_image(saved(tmp_path, content, "image.jpg"))
    assert np.abs(found.astype(int) - smooth).max() < 12


def test_a_jpeg_with_trailing_bytes_is_read(tmp_path: Path) -> None:
    assert read_image(saved(tmp_path, encode(".jpg", RGB) + b"\0" * 9)).shape == RGB.shape


def test_a_pnm_header_may_hold_comments(tmp_path: Path) -> None:
    content = b"P5\n# made by hand\n32 # wide\n24\n255\n" + GREY.tobytes()
    assert np.array_equal(read_image(saved(tmp_path, content)), GREY_AS_RGB)


def test_a_turn_noted_in_the_metadata_is_not_applied(tmp_path: Path) -> None:
    exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0"
    jpeg = encode(".jpg", RGB)
    segment = b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif
    assert read_image(saved(tmp_path, jpeg[:2] + segment + jpeg[2:])).shape == RGB.shape


PNG, JPEG, PPM = (encode(suffix, RGB) for suffix in (".png", ".jpg", ".ppm"))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"hello, world", "is no PNG, JPEG, PGM or PPM image"),
        (b"P5", "is damaged"),
        (b"P2\n2 2\n255\n1 2 3 4\n", "is no PNG"),
        (b"P5\n4 4\n15\n" + bytes(16), "up to 15"),
        (b"P5\n0 4\n255\n", "0 x 4 pixels large"),
        (PNG[:20], "is truncated"),
        (PNG[: len(PNG) // 2], "is truncated"),
        (PNG[:-1], "is truncated"),
        (PNG[:-12], "is truncated"),
        (PNG[:60] + b"\0\0\0\0" + PNG[64:], "is damaged"),
        (JPEG[: len(JPEG) // 2], "is truncated"),
        (JPEG[:-2], "is truncated"),
        (JPEG[: len(JPEG) // 2] + bytes(len(JPEG) - len(JPEG) // 2), "is truncated"),
        (JPEG[:3], "is truncated"),
        (b"\xff\xd8\xff\xd9", "is damaged"),
        (PPM[:-1], "is truncated"),
        (encode(".png", np.full((4, 4), 999, np.uint16)), "16 bits"),
        (encode(".png", np.full((4, 4, 3), 999, np.uint16)), "16 bits"),
        (encode(".pgm", np.full((4, 4), 999, np.uint16)), "16 bits"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_sentence(
    tmp_path: Path, content: bytes, words: str
) -> None:
    path = saved(tmp_path, content)
    with pytest.raises(ImageUnreadable) as refused:
        read_image(path)
    assert words in refused.value.message
    assert refused.value.message.startswith(str(path)) and refused.value.message.endswith(".")


def chunk(kind: bytes, content: bytes) -> bytes:
    checksum = zlib.crc32(kind + content).to_bytes(4, "big")
    return len(content).to_bytes(4, "big") + kind + content + checksum


COSTLY = {
    "spaces in a header": b"P6 " + b" " * 40 + b"x",
    "comments in a header": b"P6" + b"\n#\n" * 100_000,
    "100 megapixels": PNG[:8]
    + chunk(b"IHDR", struct.pack(">IIBBBBB", 10_000, 10_000, 8, 2, 0, 0, 0))
    + chunk(b"IDAT", zlib.compress(bytes(1000)))
    + chunk(b"IEND", b""),
    "chunks": PNG[:33] + chunk(b"IDAT", b"") * 2_000_000,
    "segments": JPEG[:2] + b"\xff\xfe\0\2" * 5_000_000,
    "compressed data": JPEG[:-2] + b"\xff\0" * 20_000_000,
    "scans": JPEG[:-2] + JPEG[JPEG.index(b"\xff\xda") : -2] * 2000 + JPEG[-2:],
}


@pytest.mark.parametrize("name", COSTLY)
def test_what_costs_more_than_a_picture_is_refused_at_once(tmp_path: Path, name: str) -> None:
    path = saved(tmp_path, COSTLY[name])
    began_s = time.process_time()
    with pytest.raises(ImageUnreadable):
        read_image(path)
    assert time.process_time() - began_s < 1.5


def test_a_device_is_no_image() -> None:
    with pytest.raises(ImageUnreadable, match="pipe or a device"):
        read_image(Path("/dev/zero"))


def test_a_thumbnails_end_is_not_the_images_end(tmp_path: Path) -> None:
    thumbnail = b"thumb" + JPEG
    segment = b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2, "big") + thumbnail
    whole = JPEG[:2] + segment + JPEG[2:]
    assert read_image(saved(tmp_path, whole)).shape == RGB.shape
    with pytest.raises(ImageUnreadable, match="truncated"):
        read_image(saved(tmp_path, whole[: -len(JPEG) // 3]))


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ImageUnreadable, match="There is no image"):
        read_image(tmp_path / "absent.png")
    with pytest.raises(ImageUnreadable, match="is a folder"):
        read_image(tmp_path)


def test_a_pair_must_have_one_size(tmp_path: Path) -> None:
    left = saved(tmp_path, PNG, "left.png")
    right = saved(tmp_path, encode(".png", RGB[:-1]), "right.png")
    assert [image.shape for image in read_pair(left, left)] == [RGB.shape, RGB.shape]
    with pytest.raises(PairMismatch, match=r"32 x 24 pixels.*32 x 23 pixels"):
        read_pair(left, right)


def test_an_image_must_fit_its_calibration() -> None:
    check_against(Calibration(32, 24, 40.0, 16.0, 12.0, 60.0), RGB)
    with pytest.raises(PairMismatch, match="32 x 24 pixels, its calibration 24 x 32"):
        check_against(Calibration(24, 32, 40.0, 16.0, 12.0, 60.0), RGB)


def test_written_images_come_back(tmp_path: Path) -> None:
    write_png(tmp_path / "colour.png", RGB)
    write_png(tmp_path / "grey.png", GREY)
    assert np.array_equal(read_image(tmp_path / "colour.png"), RGB)
    assert np.array_equal(read_image(tmp_path / "grey.png"), GREY_AS_RGB)
    with pytest.raises(BadInput, match="cannot be written"):
        write_png(tmp_path / "absent" / "image.png", RGB)


Mutation = Callable[[bytes, int, int], bytes]
MUTATIONS: dict[str, Mutation] = {
    "cut": lambda data, place, _value: data[:place],
    "flip": lambda data, place, value: data[:place] + bytes([value]) + data[place + 1 :],
    "drop": lambda data, place, value: data[:place] + data[place + value :],
    "zero": lambda data, place, _value: data[:place] + bytes(len(data) - place),
}


@settings(suppress_health_check=list(HealthCheck))
@given(
    content=st.sampled_from([PNG, JPEG, PPM, encode(".pgm", GREY)]),
    mutation=st.sampled_from(sorted(MUTATIONS)),
    share=st.floats(0, 1, exclude_max=True),
    value=st.integers(0, 255),
)
def test_fuzz_damaged_images_are_read_or_refused(
    tmp_path: Path, content: bytes, mutation: str, share: float, value: int
) -> None:
    damaged = MUTATIONS[mutation](content, int(share * len(content)), value)
    path = saved(tmp_path, damaged)
    try:
        image = read_image(path)
    except ImageUnreadable:
        return
    assert image.dtype == np.uint8 and image.ndim == 3 and image.shape[2] == 3
    if mutation == "cut":
        assert damaged[-2:] == content[-2:], "a cut image was read"


@settings(suppress_health_check=list(HealthCheck))
@given(head=st.sampled_from([b"", PNG[:33], JPEG[:2], b"P6\n3 4\n255\n"]), tail=st.binary())
def test_fuzz_random_bytes_are_read_or_refused(tmp_path: Path, head: bytes, tail: bytes) -> None:
    try:
        assert read_image(saved(tmp_path, head + tail)).ndim == 3
    except ImageUnreadable as error:
        assert error.message.endswith(".")
