"""A small USB3 Vision host over pyusb, to try the emulated camera with.

It takes everything for granted and recovers from nothing; errors go to the caller.
"""

from __future__ import annotations

import io
import struct
import zipfile
from array import array
from dataclasses import dataclass
from xml.etree import ElementTree

import usb.core
import usb.util
from usb.backend import IBackend

OUT, ACK, EVENTS, STREAM = 0x01, 0x81, 0x82, 0x83
PIECE = 1 << 20
PATIENCE_MS = 3000
_SPACE = "{http://www.genicam.org/GenApi/Version_1_1}"


class NotDone(Exception):
    """A command was answered with another status than success."""


@dataclass(frozen=True)
class Block:
    """One block, as it came."""

    block_id: int
    timestamp_ns: int
    width: int
    height: int
    payload: bytes
    status: int
    valid: int


def cameras(backend: IBackend | None = None) -> list[PlainHost]:
    """All that are plugged in, by serial number."""
    found = [PlainHost(device) for device in usb.core.find(find_all=True, backend=backend)]
    return sorted(found, key=lambda host: host.serial)


class PlainHost:
    """One camera, opened."""

    def __init__(self, device: usb.core.Device) -> None:
        self.device = device
        self.serial = usb.util.get_string(device, device.iSerialNumber) or ""
        for interface in range(3):
            usb.util.claim_interface(device, interface)
        self._request = 0
        self.sizes: list[int] = []
        self.registers: dict[str, tuple[int, int]] = {}

    def close(self) -> None:
        usb.util.dispose_resources(self.device)

    def command(self, code: int, payload: bytes) -> tuple[int, bytes]:
        """The status and what came with it."""
        self._request = self._request % 0xFFFF + 1
        header = struct.pack("<IHHHH", 0x43563355, 0x4000, code, len(payload), self._request)
        self.device.write(OUT, header + payload, PATIENCE_MS)
        while True:
            ack = self.transfer(1024, ACK)
            _, status, found, length, request = struct.unpack_from("<IHHHH", ack)
            if found == code + 1 and request == self._request:
                assert length == len(ack) - 12
                return status, ack[12:]

    def read(self, address: int, count: int) -> bytes:
        return self._done(0x0800, struct.pack("<QHH", address, 0, count))

    def number(self, address: int, count: int = 4) -> int:
        return int.from_bytes(self.read(address, count), "little")

    def write(self, address: int, value: int, count: int = 4) -> None:
        self._done(0x0802, struct.pack("<Q", address) + value.to_bytes(count, "little"))

    def file(self) -> bytes:
        """The first file of the manifest, as it lies in the camera."""
        manifest = self.number(0x1D0, 8)
        _, _, _, address, size = struct.unpack("<QIIQQ", self.read(manifest, 32))
        pieces = [
            self.read(address + start, min(1000, size - start)) for start in range(0, size, 1000)
        ]
        return b"".join(pieces)

    def learn(self) -> None:
        """Take the addresses of all registers from the XML."""
        file = self.file()
        if file.startswith(b"PK"):
            with zipfile.ZipFile(io.BytesIO(file)) as archive:
                file = archive.read(archive.namelist()[0])
        for node in ElementTree.fromstring(file):
            address, length = node.find(f"{_SPACE}Address"), node.find(f"{_SPACE}Length")
            if address is not None and length is not None:
                place = int(address.text or "", 16), int(length.text or "")
                self.registers[node.attrib["Name"].removesuffix("Reg")] = place

    def put(self, name: str, value: float, index: int = 0) -> None:
        """Write a feature: a float to a register of eight bytes, else a whole number."""
        address, length = self.registers[name]
        if isinstance(value, float):
            (value,) = struct.unpack("<Q", struct.pack("<d", value))
        self.write(address + 8 * index, int(value), length)

    def get(self, name: str, index: int = 0) -> int:
        address, length = self.registers[name]
        return self.number(address + 8 * index, length)

    def stream(self) -> None:
        """Set transfer sizes up as most hosts do, and switch the stream on."""
        sirm = self.number(self.number(0x1D8, 8) + 0x20, 8)
        align = 1 << (self.number(sirm) >> 24)
        count, rest = divmod(self.number(sirm + 8, 8), PIECE)
        final = -(-rest // align) * align
        self.sizes = [PIECE] * count + ([final] if final else [])
        for offset, value in ((0x18, align), (0x2C, align), (0x1C, PIECE), (0x20, count)):
            self.write(sirm + offset, value)
        self.write(sirm + 0x24, final)
        self.write(sirm + 0x28, 0)
        self.write(sirm + 4, 1)

    def transfer(self, count: int, endpoint: int = STREAM) -> bytes:
        """One transfer of at most `count` bytes."""
        into = array("B", bytes(count))
        return into[: self.device.read(endpoint, into, PATIENCE_MS)].tobytes()

    def block(self) -> Block:
        """The next block, where nothing goes wrong."""
        leader = self.transfer(1024)
        assert leader[:4] == b"U3VL", leader[:4]
        payload = b"".join(self.transfer(size) for size in self.sizes)
        trailer = self.transfer(1024)
        assert trailer[:4] == b"U3VT", trailer[:4]
        _, _, _, block_id, _, _, timestamp, _, width, height = struct.unpack_from(
            "<IHHQHHQIII", leader
        )
        _, _, _, again, status, _, valid = struct.unpack_from("<IHHQHHQ", trailer)
        assert again == block_id
        return Block(block_id, timestamp, width, height, payload, status, valid)

    def _done(self, code: int, payload: bytes) -> bytes:
        status, answer = self.command(code, payload)
        if status:
            raise NotDone(f"{status:04X}")
        return answer
