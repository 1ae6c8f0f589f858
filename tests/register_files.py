"""Small feature files, and registers in memory to bind them to."""

from __future__ import annotations

from dataclasses import dataclass, field

from fieldcam.camera.genapi import NodeMap, load_feature_file

HEAD = (
    '<RegisterDescription ModelName="Made" VendorName="Test" SchemaMajorVersion="1" '
    'SchemaMinorVersion="1" xmlns="http://www.genicam.org/GenApi/Version_1_1">'
)
DEVICE = '<Port Name="Device"/>'


@dataclass
class MemoryRegisters:
    """Registers that count how often they were asked."""

    memory: bytearray = field(default_factory=lambda: bytearray(256))
    reads: list[int] = field(default_factory=list)

    def read(self, address: int, length: int) -> bytes:
        self.reads.append(address)
        return bytes(self.memory[address : address + length])

    def write(self, address: int, data: bytes) -> None:
        self.memory[address : address + len(data)] = data


def feature_file(*nodes: str) -> bytes:
    return (HEAD + "".join(nodes) + DEVICE + "</RegisterDescription>").encode()


def node_map(*nodes: str, registers: MemoryRegisters | None = None) -> NodeMap:
    return NodeMap(load_feature_file(feature_file(*nodes)), registers or MemoryRegisters())


def register(
    name: str, address: int, *extra: str, tag: str = "IntReg", **settings: str | int | None
) -> str:
    """A register node; settings such as Length replace what is usual."""
    usual = {
        "Address": address,
        "Length": 4,
        "AccessMode": "RW",
        "pPort": "Device",
        "Endianess": "LittleEndian",
    }
    children = "".join(f"<{k}>{v}</{k}>" for k, v in (usual | settings).items() if v is not None)
    return f'<{tag} Name="{name}">{children}{"".join(extra)}</{tag}>'
