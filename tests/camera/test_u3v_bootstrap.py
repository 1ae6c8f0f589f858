"""What a camera says about itself: registers, manifest, description file."""

from __future__ import annotations

import hashlib
import struct
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scripted_usb import ScriptedControl

from fieldcam.camera.usb3vision.bootstrap import (
    Abrm,
    channel_limits,
    latch_clock,
    read_abrm,
    read_eirm,
    read_sbrm,
    read_sirm,
)
from fieldcam.camera.usb3vision.channel import ChannelLimits, ControlChannel
from fieldcam.camera.usb3vision.description import cache_folder, describe, fetch_description
from fieldcam.camera.usb3vision.descriptors import DeviceInfo, parse_device_info
from fieldcam.camera.usb3vision.manifest import (
    ManifestEntry,
    newest_first,
    parse_entry,
    read_manifest,
)
from fieldcam.camera.usb3vision.transport import LinkSpeed
from fieldcam.errors import CameraRefused, CameraUnsupported
from fieldcam.foreign.bounds import FEATURES

MANIFEST, SBRM, SIRM, EIRM, FILE = 0x60000, 0x0200_0000, 0x62000, 0x63000, 0x70000
XML = b"<?xml version='1.0'?><RegisterDescription/>" * 30


def text(value: str) -> bytes:
    return value.encode().ljust(64, b"\0")


def camera() -> ScriptedControl:
    """Registers as a maker might lay them out."""
    scripted = ScriptedControl()
    scripted.put(0, struct.pack("<HH", 3, 1))
    names = ("Orchard Optics", "Twin", "Stereo", "1.2", "info", "A-17", "left eye")
    scripted.put(4, b"".join(text(name) for name in names))
    scripted.put(0x1C4, struct.pack("<QIQQ", 0, 250, MANIFEST, SBRM))
    scripted.put(0x1F0, struct.pack("<QI", 123_456_789_000, 0))
    scripted.put(SBRM, struct.pack("<HHQQIII", 1, 1, 0b11, 0, 1024, 2048, 1))
    scripted.put(SBRM + 0x20, struct.pack("<QIQIQI", SIRM, 0x30, EIRM, 0xC, 0, 0b1000))
    scripted.put(SIRM, struct.pack("<IIQII", 10 << 24, 0, 3_110_400, 52, 32))
    scripted.put(EIRM, struct.pack("<II", 0, 1024))
    return scripted


def opened(scripted: ScriptedControl) -> ControlChannel:
    return ControlChannel(scripted, scripted)


def test_registers_are_found_by_their_pointers() -> None:
    registers = opened(camera())
    abrm = read_abrm(registers)
    assert abrm == Abrm(
        (1, 3),
        *("Orchard Optics", "Twin", "Stereo", "1.2", "info", "A-17", "left eye"),
        0.25,
        MANIFEST,
        SBRM,
    )
    sbrm = read_sbrm(registers, abrm)
    assert (sbrm.u3v_version, sbrm.stream_channels, sbrm.speed) == ((1, 1), 1, LinkSpeed.SUPER)
    assert channel_limits(abrm, sbrm) == ChannelLimits(1024, 2048, 1.0)
    sirm = read_sirm(registers, sbrm)
    assert (sirm.address, sirm.alignment_bytes) == (SIRM, 1024)
    assert (sirm.payload_bytes, sirm.leader_bytes, sirm.trailer_bytes) == (3_110_400, 52, 32)
    eirm = read_eirm(registers, sbrm)
    assert eirm is not None
    assert (eirm.address, eirm.event_bytes) == (EIRM, 1024)


def test_a_camera_without_stream_or_events_says_so() -> None:
    scripted = camera()
    scripted.put(SBRM + 4, bytes(8))
    registers = opened(scripted)
    sbrm = read_sbrm(registers, read_abrm(registers))
    assert read_eirm(registers, sbrm) is None
    with pytest.raises(CameraUnsupported, match="no image stream"):
        read_sirm(registers, sbrm)


def test_a_name_that_a_camera_leaves_out_is_empty() -> None:
    scripted = camera()
    scripted.refusal = lambda address, length: 0x8001 if address == 0x184 else 0
    assert read_abrm(opened(scripted)).user_name == ""


@pytest.mark.parametrize(("register", "value"), [(0x14, 16), (0x18, 12), (0x14, 0), (0x18, 0)])
def test_impossible_packet_lengths_are_refused(register: int, value: int) -> None:
    scripted = camera()
    scripted.put(SBRM + register, struct.pack("<I", value))
    registers = opened(scripted)
    abrm = read_abrm(registers)
    with pytest.raises(CameraUnsupported, match=f"hold {value} bytes"):
        channel_limits(abrm, read_sbrm(registers, abrm))


def test_an_impossible_alignment_is_refused() -> None:
    scripted = camera()
    scripted.put(SIRM + 3, b"\xff")
    registers = opened(scripted)
    with pytest.raises(CameraUnsupported, match=r"2\^255"):
        read_sirm(registers, read_sbrm(registers, read_abrm(registers)))


@pytest.mark.parametrize(
    ("bits", "speed"),
    [(0, 0), (0b1, 1), (0b100, 3), (0b1000, 4), (0b10000, 5), (0b100000, 0), (0b1100, 0)],
)
def test_only_one_known_bit_is_a_speed(bits: int, speed: int) -> None:
    scripted = camera()
    scripted.put(SBRM + 0x40, struct.pack("<I", bits))
    registers = opened(scripted)
    assert read_sbrm(registers, read_abrm(registers)).speed == speed


def test_a_camera_may_keep_its_speed_to_itself() -> None:
    scripted = camera()
    scripted.refusal = lambda address, length: 0x8003 if address == SBRM + 0x40 else 0
    registers = opened(scripted)
    assert read_sbrm(registers, read_abrm(registers)).speed is LinkSpeed.UNKNOWN


def test_the_clock_is_latched_between_two_readings_of_the_hosts() -> None:
    scripted = camera()
    sample = latch_clock(opened(scripted))
    assert sample.device_ns == 123_456_789_000
    assert sample.uncertainty_ns >= 0
    assert [request[2:] for request in scripted.requests] == [(0x1F8, 4), (0x1F0, 8)]


def test_a_camera_without_a_latch_is_said_to_refuse() -> None:
    scripted = camera()
    scripted.refusal = lambda address, length: 0x8001 if address == 0x1F8 else 0
    with pytest.raises(CameraRefused):
        latch_clock(opened(scripted))


def entry(
    content: bytes = XML, *, file_format: int = 0, schema: int = 1, version: int = 1, kind: int = 0
) -> bytes:
    sha1 = hashlib.sha1(content).digest()
    info = schema << 24 | 1 << 16 | file_format << 10 | kind
    return struct.pack("<HBBIQQ20s20x", 7, 2, version, info, FILE, len(content), sha1)


def manifest(scripted: ScriptedControl, *entries: bytes) -> tuple[ManifestEntry, ...]:
    scripted.put(MANIFEST, struct.pack("<Q", len(entries)) + b"".join(entries))
    registers = opened(scripted)
    return read_manifest(registers, read_abrm(registers))


def test_the_newest_readable_description_is_chosen() -> None:
    entries = manifest(
        camera(),
        entry(version=1),
        entry(version=3),
        entry(schema=0, version=9),
        entry(version=8, file_format=2),
        entry(version=8, kind=1),
    )
    chosen = newest_first(entries)[0]
    assert chosen.file_version == (3, 2, 7)
    assert chosen.schema_version == (1, 1)
    assert (chosen.address, chosen.length) == (FILE, len(XML))


@pytest.mark.parametrize("count", [0, 65, 1 << 40])
def test_an_impossible_number_of_descriptions_is_refused(count: int) -> None:
    scripted = camera()
    scripted.put(MANIFEST, struct.pack("<Q", count))
    registers = opened(scripted)
    with pytest.raises(CameraUnsupported, match=f"has {count} description files"):
        read_manifest(registers, read_abrm(registers))


GOOD = (
    b'<RegisterDescription VendorName="V" ModelName="Old" SchemaMajorVersion="1"'
    b' SchemaMinorVersion="1"><Category Name="Root"/></RegisterDescription>'
)


def test_a_broken_newest_description_is_followed_by_the_older_good_one(tmp_path: Path) -> None:
    scripted = camera()
    older = struct.pack("<Q", FILE + 0x1000)
    entries = [entry(b"<torn", version=3), entry(GOOD, version=2, file_format=1)]
    entries[1] = entries[1][:8] + older + entries[1][16:]
    scripted.put(FILE, b"<torn")
    scripted.put(FILE + 0x1000, GOOD)
    described = describe(opened(scripted), newest_first(manifest(scripted, *entries)), tmp_path)
    assert described.document.model == "Old"  # and called zipped, which it is not
    assert described.note.startswith("An older description is used: The feature file is no proper")


def test_a_file_given_by_hand_serves_a_camera_whose_own_cannot_be_read(tmp_path: Path) -> None:
    scripted = camera()
    scripted.put(FILE, b"<torn")
    entries = newest_first(manifest(scripted, entry(b"<torn")))
    with pytest.raises(CameraUnsupported) as refused:
        describe(opened(scripted), entries, tmp_path)
    assert "`feature_file` in camera.toml" in refused.value.hint
    given = tmp_path / "maker.xml"
    with pytest.raises(CameraUnsupported, match="cannot be read either: There is no feature file"):
        describe(opened(scripted), entries, tmp_path, given)
    given.write_bytes(GOOD)
    described = describe(opened(scripted), entries, tmp_path, given)
    assert (described.document.model, described.content) == ("Old", GOOD)
    assert described.note.startswith("maker.xml is used: The feature file is no proper XML")


def test_a_camera_that_describes_itself_serves_without_the_given_file(tmp_path: Path) -> None:
    scripted = camera()
    scripted.put(FILE, GOOD)
    entries = newest_first(manifest(scripted, entry(GOOD, file_format=5)))
    described = describe(opened(scripted), entries, tmp_path, tmp_path / "none")
    assert (described.document.model, described.note) == ("Old", "")


def test_a_description_is_read_once_and_then_kept(tmp_path: Path) -> None:
    scripted = camera()
    scripted.put(FILE, XML)
    (chosen,) = newest_first(manifest(scripted, entry()))
    assert fetch_description(opened(scripted), chosen, tmp_path) == XML
    scripted.requests.clear()
    assert fetch_description(opened(scripted), chosen, tmp_path) == XML
    assert not scripted.requests


def test_a_damaged_kept_description_is_fetched_again(tmp_path: Path) -> None:
    scripted = camera()
    scripted.put(FILE, XML)
    (chosen,) = newest_first(manifest(scripted, entry()))
    fetch_description(opened(scripted), chosen, tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.write_bytes(b"half a f")
    assert fetch_description(opened(scripted), chosen, tmp_path) == XML
    assert kept.read_bytes() == XML


@pytest.mark.parametrize("sha1", [bytes(20), b"\x11" * 20], ids=["none", "of something else"])
def test_a_description_without_its_hash_is_never_kept(tmp_path: Path, sha1: bytes) -> None:
    scripted = camera()
    scripted.put(FILE, XML)
    chosen = parse_entry(entry()[:24] + sha1 + bytes(20))
    assert fetch_description(opened(scripted), chosen, tmp_path) == XML
    assert not list(tmp_path.iterdir())


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path: Path) -> None:
    scripted = camera()
    scripted.put(FILE, XML)
    blocked = tmp_path / "file"
    blocked.touch()
    assert fetch_description(opened(scripted), parse_entry(entry()), blocked / "below") == XML


@pytest.mark.parametrize("length", [0, FEATURES.most_bytes + 1, 1 << 60])
def test_an_impossible_length_is_refused_unread(tmp_path: Path, length: int) -> None:
    scripted = camera()
    content = entry()
    impossible = content[:16] + struct.pack("<Q", length) + content[24:]
    with pytest.raises(CameraUnsupported, match=f"has {length} bytes"):
        fetch_description(opened(scripted), parse_entry(impossible), tmp_path)
    assert not scripted.requests


@given(st.binary(min_size=64, max_size=64))
def test_fuzz_any_manifest_entry_is_parsed(content: bytes) -> None:
    parsed = parse_entry(content)
    assert parsed.sha1 is None or len(parsed.sha1) == 20
    assert parsed.length < 1 << 64


def test_descriptions_are_kept_in_the_users_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert cache_folder() == Path("/somewhere/fieldcam/descriptions")
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_folder() == Path.home() / ".cache/fieldcam/descriptions"


WHOLE = bytes((20, 0x24, 1)) + struct.pack("<4H9B", 2, 1, 3, 1, *range(1, 10))
OTHER = bytes((5, 0x24, 9, 1, 2))


@pytest.mark.parametrize("extra", [WHOLE, OTHER + WHOLE, WHOLE + OTHER])
def test_the_class_specific_descriptor_is_found_among_others(extra: bytes) -> None:
    assert parse_device_info(extra) == DeviceInfo((1, 2), (1, 3), *range(1, 10))


def test_a_shortened_descriptor_reads_as_zeros() -> None:
    shortened = bytes((12,)) + WHOLE[1:12]
    assert parse_device_info(shortened) == DeviceInfo((1, 2), (1, 3), 1, *[0] * 8)


@pytest.mark.parametrize("extra", [b"", OTHER, bytes(20), b"\x02\x24\x01"])
def test_a_camera_without_the_descriptor_has_none(extra: bytes) -> None:
    assert parse_device_info(extra) is None


@given(st.binary(max_size=60))
def test_fuzz_any_descriptors_end(extra: bytes) -> None:
    for candidate in (extra, extra + WHOLE, bytes((20, 0x24, 1)) + extra):
        parse_device_info(candidate)
