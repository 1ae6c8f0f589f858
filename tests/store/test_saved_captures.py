"""A pair that was announced as saved is on the disk, whole and unchanged."""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcam.disk.durable import write_durably
from fieldcam.disk.raw_images import decode_raw, encode_raw
from fieldcam.errors import ImageUnreadable, StorageError, StorageFull
from fieldcam.store.captures import load_raw
from fieldcam.store.connection import rows
from fieldcam.store.folder import DataKind, data_path, open_data_folder
from fieldcam.store.store import open_store
from fieldcam.values import ImageU8, PixelFormat, RawPair


def raw_pair(shape: tuple[int, ...] = (6, 8), simulated: bool = False) -> RawPair:
    rng = np.random.default_rng(1)
    left, right = (rng.integers(0, 256, shape).astype(np.uint8) for _ in range(2))
    pixel_format = PixelFormat.RGB8 if len(shape) == 3 else PixelFormat.BAYER_RG8
    taken_at = datetime(2026, 5, 21, 9, 0, 0, 250_000, tzinfo=UTC)
    return RawPair(left, right, pixel_format, taken_at, 5, 7, "L1", "R1", 3, simulated)


@pytest.mark.parametrize("shape", [(6, 8), (6, 8, 3)])
def test_a_saved_pair_comes_back_unchanged(tmp_path: Path, shape: tuple[int, ...]) -> None:
    raw = raw_pair(shape)
    with open_store(tmp_path, DataKind.FIELD) as store:
        back = load_raw(store.save(raw))
    np.testing.assert_array_equal(back.left, raw.left)
    np.testing.assert_array_equal(back.right, raw.right)
    blank = np.zeros((1, 1), np.uint8)
    for field in ("pixel_format", "taken_at", "left_timestamp_ns", "right_serial", "simulated"):
        assert getattr(back, field) == getattr(raw, field)
    assert replace(back, left=blank, right=blank).trigger_ordinal == 3


def test_the_same_image_is_kept_once(tmp_path: Path) -> None:
    with open_store(tmp_path, DataKind.FIELD) as store:
        first, second = store.save(raw_pair()), store.save(raw_pair())
    assert first.left == second.left
    assert first.key != second.key
    assert len(list((tmp_path / "objects").rglob("*.pgm"))) == 2


def test_simulated_and_real_captures_do_not_mix(tmp_path: Path) -> None:
    field, demo = tmp_path / "field", tmp_path / "demo"
    with open_store(field, DataKind.FIELD) as store, pytest.raises(StorageError):
        store.save(raw_pair(simulated=True))
    with pytest.raises(StorageError):
        open_store(field, DataKind.SIMULATED)
    with open_store(demo, DataKind.SIMULATED) as store, pytest.raises(StorageError):
        store.save(raw_pair())


@pytest.mark.parametrize(
    ("code", "expected"),
    [(errno.ENOSPC, StorageFull), (errno.EDQUOT, StorageFull), (errno.EROFS, StorageError)],
)
def test_a_failed_write_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int, expected: type[StorageError]
) -> None:
    def fail(descriptor: int) -> NoReturn:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(expected):
        write_durably(tmp_path / "file", b"content")
    assert list(tmp_path.iterdir()) == []


def test_the_row_is_written_after_both_images_and_their_facts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[tuple[str, int]] = []
    rename = Path.replace

    with open_store(tmp_path, DataKind.FIELD) as store:

        def remember(self: Path, target: Path) -> Path:
            known = len(rows(store.database, "SELECT id FROM capture"))
            written.append((target.suffix, known))
            return rename(self, target)

        monkeypatch.setattr(Path, "replace", remember)
        store.save(raw_pair())
    assert written == [(".pgm", 0), (".pgm", 0), (".json", 0)]


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"kind": "other"}'])
def test_a_damaged_marker_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "fieldcam-data.json").write_text(text)
    with pytest.raises(StorageError):
        open_data_folder(tmp_path, DataKind.FIELD)


def test_where_the_data_folder_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "xdg"))
    monkeypatch.delenv("FIELDCAM_DATA", raising=False)
    assert data_path(None) == tmp_path / "xdg/fieldcam"
    assert data_path(None, DataKind.SIMULATED) == tmp_path / "xdg/fieldcam-demo"
    monkeypatch.setenv("FIELDCAM_DATA", str(tmp_path / "row"))
    assert data_path(None) == tmp_path / "row"
    assert data_path(None, DataKind.SIMULATED) == tmp_path / "row-demo"
    assert data_path(tmp_path / "option") == tmp_path / "option"


def test_a_capture_whose_files_are_gone_is_a_storage_error(tmp_path: Path) -> None:
    with open_store(tmp_path, DataKind.FIELD) as store:
        saved = store.save(raw_pair())
    saved.right.unlink()
    with pytest.raises(StorageError):
        load_raw(saved)


@given(
    st.tuples(st.integers(1, 9), st.integers(1, 9), st.booleans()),
    st.integers(0, 2**32 - 1),
)
def test_raw_images_round_trip(size: tuple[int, int, bool], seed: int) -> None:
    height, width, colour = size
    shape = (height, width, 3) if colour else (height, width)
    image: ImageU8 = np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)
    np.testing.assert_array_equal(decode_raw(encode_raw(image), "image"), image)


@given(st.binary(max_size=40), st.integers(0, 60))
def test_fuzz_raw_images_end_in_one_sentence(noise: bytes, cut: int) -> None:
    whole = encode_raw(np.zeros((5, 7), np.uint8))
    for content in (noise, whole[:cut] + noise[:1], b"P5\n" + noise):
        try:
            image = decode_raw(content, "image")
        except ImageUnreadable as error:
            assert "image" in error.message
        else:
            assert image.dtype == np.uint8


def test_a_damaged_copy_is_not_read(tmp_path: Path) -> None:
    with open_store(tmp_path, DataKind.FIELD) as store:
        saved = store.save(raw_pair())
        content = bytearray(saved.right.read_bytes())
        content[-1] ^= 1
        saved.right.write_bytes(content)
        with pytest.raises(ImageUnreadable, match="right image of this picture is damaged"):
            load_raw(saved)
        store.save(raw_pair())
        load_raw(saved)
