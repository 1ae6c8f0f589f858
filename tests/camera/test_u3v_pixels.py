"""Images out of frames, for each way to store a pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcam.camera.usb3vision.blocks import ImageInfo
from fieldcam.camera.usb3vision.frames import UsbFrame
from fieldcam.camera.usb3vision.pixels import CODINGS, decode
from fieldcam.errors import CameraUnsupported
from fieldcam.values import PixelFormat

MOSAICS = (
    PixelFormat.MONO8,
    PixelFormat.BAYER_GR8,
    PixelFormat.BAYER_RG8,
    PixelFormat.BAYER_GB8,
    PixelFormat.BAYER_BG8,
)
# Written down a second time, from the public list of the naming convention,
# in the order of MOSAICS.
FORMATS = {
    "8": (0x01080001, 0x01080008, 0x01080009, 0x0108000A, 0x0108000B),
    "10": (0x01100003, 0x0110000C, 0x0110000D, 0x0110000E, 0x0110000F),
    "12": (0x01100005, 0x01100010, 0x01100011, 0x01100012, 0x01100013),
    "16": (0x01100007, 0x0110002E, 0x0110002F, 0x01100030, 0x01100031),
    "10p": (0x010A0046, 0x010A0056, 0x010A0058, 0x010A0054, 0x010A0052),
    "12p": (0x010C0047, 0x010C0057, 0x010C0059, 0x010C0055, 0x010C0053),
    "10Packed": (0x010C0004, 0x010C0026, 0x010C0027, 0x010C0028, 0x010C0029),
    "12Packed": (0x010C0006, 0x010C002A, 0x010C002B, 0x010C002C, 0x010C002D),
}
ALL = [
    (coding, mosaic, value)
    for coding, row in FORMATS.items()
    for mosaic, value in zip(MOSAICS, row, strict=True)
]


def stored(values: list[int], coding: str) -> bytes:
    """One row of pixel values as the camera stores them."""
    bits = int(coding.removesuffix("p").removesuffix("Packed"))
    if coding.endswith("p"):
        stream = sum(value << bits * place for place, value in enumerate(values))
        return stream.to_bytes(len(values) * bits // 8, "little")
    if coding.endswith("Packed"):
        low, high = bits - 8, list(zip(values[::2], values[1::2], strict=True))
        mask = (1 << low) - 1
        triples = [(a >> low, (a & mask) | (b & mask) << 4, b >> low) for a, b in high]
        return bytes(byte for triple in triples for byte in triple)
    return b"".join(value.to_bytes(-(-bits // 8), "little") for value in values)


def frame(payload: bytes, pixel_format: int, width: int, height: int, padding: int = 0) -> UsbFrame:
    info = ImageInfo(pixel_format, width, height, 0, 0, padding)
    memory = np.frombuffer(payload, np.uint8)
    return UsbFrame(1, 0, 0, 1, info, memory, 0)


@given(st.sampled_from(ALL), st.integers(1, 4), st.integers(1, 4), st.data())
def test_every_coding_gives_the_highest_eight_bits(
    case: tuple[str, PixelFormat, int], groups: int, height: int, data: st.DataObject
) -> None:
    coding, mosaic, value = case
    width, bits = 4 * groups, int(coding.removesuffix("p").removesuffix("Packed"))
    row = st.lists(st.integers(0, (1 << bits) - 1), min_size=width, max_size=width)
    rows = data.draw(st.lists(row, min_size=height, max_size=height))
    padding = data.draw(st.sampled_from([0, 0, 3]))
    payload = b"".join(stored(values, coding) + bytes(padding) for values in rows)
    image, pixel_format = decode(frame(payload + b"behind", value, width, height, padding))
    assert pixel_format is mosaic
    assert image.dtype == np.uint8
    np.testing.assert_array_equal(image, np.array(rows) >> (bits - 8))


def test_all_codings_are_tested() -> None:
    assert {value for _, _, value in ALL} | {0x02180014, 0x02180015} == set(CODINGS)


@pytest.mark.parametrize(("value", "order"), [(0x02180014, [0, 1, 2]), (0x02180015, [2, 1, 0])])
def test_colours_come_as_rgb(value: int, order: list[int]) -> None:
    pixels = np.arange(2 * 5 * 3, dtype=np.uint8).reshape(2, 5, 3)
    padded = np.pad(pixels.reshape(2, 15), ((0, 0), (0, 1)))
    image, pixel_format = decode(frame(padded.tobytes(), value, 5, 2, padding=1))
    assert pixel_format is PixelFormat.RGB8
    np.testing.assert_array_equal(image, pixels[..., order])


@pytest.mark.parametrize("value", [0x01080009, 0x02180014, 0x02180015])
@pytest.mark.parametrize("padding", [0, 8])
def test_eight_bit_images_are_not_copied(value: int, padding: int) -> None:
    received = frame(bytes(8 * (8 * (value >> 16 & 0xFF) // 8 + padding)), value, 8, 8, padding)
    image, _ = decode(received)
    assert np.shares_memory(image, received.payload)


@pytest.mark.parametrize(
    ("received", "words"),
    [
        (frame(bytes(64), 0x01080099, 8, 8), "0x01080099 is unknown"),
        (frame(bytes(64), 0x010C0059, 3, 3), "3 x 3 pixels"),
        (frame(bytes(64), 0x01080009, 0, 8), "0 x 8 pixels"),
        (frame(bytes(64), 0x01080009, 8, 0), "8 x 0 pixels"),
        (UsbFrame(1, 0, 0, 0x1001, None, np.zeros(8, np.uint8), 0), "type 0x1001"),
    ],
)
def test_what_is_no_image_is_refused(received: UsbFrame, words: str) -> None:
    with pytest.raises(CameraUnsupported, match=words):
        decode(received)


@given(
    st.one_of(st.sampled_from(sorted(CODINGS)), st.integers(0, 2**32 - 1)),
    st.integers(0, 40),
    st.integers(0, 40),
    st.integers(0, 9),
)
def test_fuzz_any_leader_gives_an_image_of_its_size_or_is_refused(
    value: int, width: int, height: int, padding: int
) -> None:
    info = ImageInfo(value, width, height, 0, 0, padding)
    try:
        image, _ = decode(frame(bytes(info.size_bytes), value, width, height, padding))
    except CameraUnsupported:
        return
    assert image.shape[:2] == (height, width)
