"""The emulated camera under pyusb in this process: descriptors, registers, GenCP."""

from __future__ import annotations

import errno
import hashlib
import io
import struct
import zipfile
from collections.abc import Iterator
from xml.etree import ElementTree

import pytest
import usb.core
import usb.util
from emulated_camera.backend import EmulatedBackend
from emulated_camera.bootstrap import FileKind
from emulated_camera.bus import UsbBus
from emulated_camera.camera import Camera
from emulated_camera.clocks import SteppedClock
from emulated_camera.descriptors import Speed
from emulated_camera.faults import ALWAYS, Fault
from emulated_camera.pictures import gradients
from emulated_camera.sensor import Sensor
from emulated_camera.shapes import HEAD_SERIAL, LEFT_SERIAL, RIGHT_SERIAL, Shape, stereo_head
from hypothesis import given
from hypothesis import strategies as st
from plain_host import ACK, OUT, NotDone, PlainHost, cameras

SOURCE = gradients(64, 48, 8)
EYE = Sensor(width_px=64, height_px=48)


@pytest.fixture
def bus() -> UsbBus:
    return UsbBus(SteppedClock())


@pytest.fixture
def camera(bus: UsbBus) -> Camera:
    head = stereo_head(bus, Shape.SIDE_BY_SIDE, SOURCE, EYE)
    head.plug()
    return head.cameras[0]


@pytest.fixture
def host(bus: UsbBus, camera: Camera) -> Iterator[PlainHost]:
    (found,) = cameras(EmulatedBackend(bus))
    found.learn()
    yield found
    found.close()


def test_two_devices_are_told_apart_by_their_serial_numbers(bus: UsbBus) -> None:
    stereo_head(bus, Shape.TWO_DEVICES, SOURCE, EYE).plug()
    found = cameras(EmulatedBackend(bus))
    assert [host.serial for host in found] == [LEFT_SERIAL, RIGHT_SERIAL]
    assert found[0].device.address != found[1].device.address


def test_the_descriptors_say_what_it_is(host: PlainHost) -> None:
    configuration = host.device.get_active_configuration()
    kinds = [(i.bInterfaceClass, i.bInterfaceSubClass, i.bInterfaceProtocol) for i in configuration]
    assert kinds == [(0xEF, 5, 0), (0xEF, 5, 1), (0xEF, 5, 2)]
    ends = [[endpoint.bEndpointAddress for endpoint in i] for i in configuration]
    assert ends == [[0x81, 0x01], [0x82], [0x83]]
    special = bytes(configuration.interfaces()[0].extra_descriptors)
    assert special[:3] == bytes([20, 0x24, 1])
    names = [usb.util.get_string(host.device, index) for index in special[11:19]]
    assert names[1:3] == ["Emulated Optics", "Flash Eye 1440"]
    assert names[6] == HEAD_SERIAL
    assert host.device.bcdUSB == 0x0300
    assert host.device.speed == 4


def test_a_usb_2_port_shows_everywhere(bus: UsbBus, camera: Camera) -> None:
    bus.unplug(camera)
    bus.plug(camera, Speed.HIGH)
    (host,) = cameras(EmulatedBackend(bus))
    configuration = host.device.get_active_configuration()
    assert (host.device.bcdUSB, host.device.speed) == (0x0210, 3)
    assert configuration.interfaces()[0].endpoints()[0].wMaxPacketSize == 512
    assert host.number(host.number(0x1D8, 8) + 0x40) == 4


@pytest.mark.parametrize("kind", FileKind)
def test_the_manifest_leads_to_the_file_with_its_hash(bus: UsbBus, kind: FileKind) -> None:
    eye = Sensor(width_px=64, height_px=48, file_kind=kind)
    stereo_head(bus, Shape.SIDE_BY_SIDE, SOURCE, eye).plug()
    (host,) = cameras(EmulatedBackend(bus))
    entry = host.read(host.number(0x1D0, 8) + 8, 64)
    file = host.file()
    assert entry[24:44] == hashlib.sha1(file).digest()
    assert struct.unpack_from("<I", entry, 4)[0] >> 10 & 0x3F == kind.value
    assert file.startswith(b"PK" if kind is FileKind.ZIPPED else b"<?xml")


def test_every_name_in_the_xml_leads_somewhere(camera: Camera) -> None:
    root = ElementTree.fromstring(camera.xml)
    names = {node.attrib["Name"] for node in root}
    assert len(names) == len(list(root))
    for node in root.iter():
        tag = node.tag.rpartition("}")[2]
        if tag.startswith("p") and tag != "pPort":
            assert node.text in names, tag


def test_all_registers_of_the_xml_can_be_read(host: PlainHost) -> None:
    root = ElementTree.fromstring(host_xml(host))
    elsewhere = {node.attrib["Name"] for node in root if has_port_of_its_own(node)}
    assert elsewhere
    for name, (address, length) in host.registers.items():
        if f"{name}Reg" not in elsewhere:
            assert len(host.read(address, length)) == length


def host_xml(host: PlainHost) -> bytes:
    with zipfile.ZipFile(io.BytesIO(host.file())) as archive:
        return archive.read(archive.namelist()[0])


def has_port_of_its_own(node: ElementTree.Element) -> bool:
    port = node.find("{http://www.genicam.org/GenApi/Version_1_1}pPort")
    return port is not None and port.text != "Device"


def command(code: int, payload: bytes, request: int = 7) -> bytes:
    return struct.pack("<IHHHH", 0x43563355, 0x4000, code, len(payload), request) + payload


@pytest.mark.parametrize(
    ("code", "payload", "status"),
    [
        (0x0800, struct.pack("<QHH", 0x004, 0, 64), 0x0000),
        (0x0800, struct.pack("<QHH", 0x004, 0, 4096), 0x8002),
        (0x0800, struct.pack("<QHH", 0x004, 0, 0), 0x8002),
        (0x0800, b"short", 0x8002),
        (0x0800, struct.pack("<QHH", 0x7_0000_0000, 0, 4), 0x8003),
        (0x0800, struct.pack("<QHH", 0x006, 0, 4), 0x8005),
        (0x0800, struct.pack("<QHH", 0x004, 0, 3), 0x8005),
        (0x0802, struct.pack("<QI", 0x004, 0), 0x8004),
        (0x0802, struct.pack("<QI", 0x1CC, 5), 0x8004),
        (0x0802, struct.pack("<QI", 0x1E0, 5), 0x8002),
        (0x0804, b"", 0x8001),
    ],
)
def test_commands_are_answered_with_their_status(
    host: PlainHost, code: int, payload: bytes, status: int
) -> None:
    assert host.command(code, payload)[0] == status


def test_a_wrong_length_is_an_invalid_header(host: PlainHost) -> None:
    wrong = struct.pack("<IHHHH", 0x43563355, 0x4000, 0x0800, 99, 3) + struct.pack("<QHH", 4, 0, 4)
    host.device.write(OUT, wrong)
    assert struct.unpack_from("<H", host.transfer(1024, ACK), 4) == (0x800E,)


@pytest.mark.parametrize(
    ("name", "value"),
    [("Width", 63), ("Width", 4096), ("PixelFormat", 1), ("ExposureTime", 1.0)],
)
def test_values_out_of_range_are_refused(host: PlainHost, name: str, value: float) -> None:
    before = host.get(name)
    with pytest.raises(NotDone, match="8002"):
        host.put(name, value)
    assert host.get(name) == before


def test_the_size_is_locked_while_transport_parameters_are(host: PlainHost) -> None:
    host.put("TLParamsLocked", 1)
    with pytest.raises(NotDone, match="8006"):
        host.put("Width", 32)
    host.put("TLParamsLocked", 0)
    host.put("Width", 32)
    assert host.get("PayloadSize") == 32 * 48


def test_the_frame_rate_is_there_only_where_it_is_limited(host: PlainHost) -> None:
    host.put("AcquisitionFrameRateEnable", 0)
    with pytest.raises(NotDone, match="8006"):
        host.put("AcquisitionFrameRate", 10.0)
    host.put("AcquisitionFrameRateEnable", 1)
    host.put("AcquisitionFrameRate", 10.0)


def test_the_user_set_brings_the_defaults_back(host: PlainHost) -> None:
    host.put("ExposureTime", 900.0)
    host.put("UserSetSelector", 1)
    host.put("UserSetSave", 1)
    host.put("ExposureTime", 100.0)
    host.put("UserSetLoad", 1)
    assert struct.unpack("<d", host.read(host.registers["ExposureTime"][0], 8)) == (900.0,)
    host.put("UserSetSelector", 0)
    host.put("UserSetLoad", 1)
    assert struct.unpack("<d", host.read(host.registers["ExposureTime"][0], 8)) == (500.0,)


def acks(host: PlainHost, request: int) -> list[tuple[int, int, int]]:
    """Status, id and request id of all acks to a read with this request id."""
    host.device.write(OUT, command(0x0800, struct.pack("<QHH", 0x1CC, 0, 4), request))
    found: list[tuple[int, int, int]] = []
    while True:
        try:
            _, status, code, _, again = struct.unpack_from("<IHHHH", host.transfer(1024, ACK))
        except usb.core.USBTimeoutError:
            return found
        found.append((status, code, again))


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        (None, [(0, 0x0801, 9)]),
        (Fault.NO_ACK, []),
        (Fault.STALE_ACK, [(0, 0x0801, 8), (0, 0x0801, 9)]),
        (Fault.PENDING_ACK, [(0, 0x0805, 9), (0, 0x0801, 9)]),
        (Fault.BUSY, [(0x8007, 0x0801, 9)]),
    ],
)
def test_faults_of_the_control_channel(
    host: PlainHost,
    camera: Camera,
    fault: Fault | None,
    expected: list[tuple[int, int, int]],
) -> None:
    if fault:
        camera.faults.arm(fault)
    assert acks(host, 9) == expected
    assert acks(host, 10) == [(0, 0x0801, 10)]


@pytest.mark.parametrize(
    ("fault", "number"), [(Fault.IN_USE, errno.EBUSY), (Fault.KERNEL_DRIVER, errno.EBUSY)]
)
def test_an_interface_in_use_cannot_be_claimed(
    bus: UsbBus, camera: Camera, fault: Fault, number: int
) -> None:
    camera.faults.arm(fault, ALWAYS)
    (device,) = usb.core.find(find_all=True, backend=EmulatedBackend(bus))
    with pytest.raises(usb.core.USBError) as caught:
        usb.util.claim_interface(device, 0)
    assert caught.value.errno == number


def test_a_kernel_driver_can_be_detached(bus: UsbBus, camera: Camera) -> None:
    camera.faults.arm(Fault.KERNEL_DRIVER, ALWAYS)
    (device,) = usb.core.find(find_all=True, backend=EmulatedBackend(bus))
    assert device.is_kernel_driver_active(0)
    device.detach_kernel_driver(0)
    usb.util.claim_interface(device, 0)


def test_a_device_without_a_rule_cannot_be_opened(bus: UsbBus, camera: Camera) -> None:
    bus.unplug(camera)
    bus.plug(camera, permitted=False)
    (device,) = usb.core.find(find_all=True, backend=EmulatedBackend(bus))
    with pytest.raises(usb.core.USBError) as caught:
        usb.util.claim_interface(device, 0)
    assert caught.value.errno == errno.EACCES


def test_an_unplugged_device_is_gone_and_comes_back_elsewhere(
    bus: UsbBus, camera: Camera, host: PlainHost
) -> None:
    bus.unplug(camera)
    with pytest.raises(usb.core.USBError) as caught:
        host.read(0x1CC, 4)
    assert caught.value.errno == errno.ENODEV
    assert cameras(EmulatedBackend(bus)) == []
    bus.plug(camera)
    (again,) = cameras(EmulatedBackend(bus))
    assert (again.serial, again.device.address) == (host.serial, (host.device.address or 0) + 1)


def test_what_is_opened_and_closed_is_counted(bus: UsbBus, camera: Camera) -> None:
    backend = EmulatedBackend(bus)
    (found,) = cameras(backend)
    assert backend.open_handles == 1
    found.close()
    assert backend.open_handles == 0


def test_a_reset_takes_it_off_the_bus_for_a_while(
    bus: UsbBus, camera: Camera, host: PlainHost
) -> None:
    host.put("ExposureTime", 900.0)
    with pytest.raises(usb.core.USBError):
        host.put("DeviceReset", 1)
    assert bus.plugged == ()
    with bus.changed:
        bus.clock.wait(bus.changed, 1_000_000_000)
    (again,) = cameras(EmulatedBackend(bus))
    again.learn()
    assert struct.unpack("<d", again.read(again.registers["ExposureTime"][0], 8)) == (500.0,)


FUZZED = UsbBus(SteppedClock())
FUZZED.plug(stereo_head(FUZZED, Shape.SIDE_BY_SIDE, SOURCE, EYE).cameras[0])


@given(st.binary(max_size=1100) | st.builds(command, st.integers(0, 0xFFFF), st.binary()))
def test_fuzzed_commands_get_an_ack_or_nothing(data: bytes) -> None:
    (plugged,) = FUZZED.plugged
    assert FUZZED.send(plugged, OUT, data) == 0
    answer = FUZZED.take(plugged, ACK, 1024)
    if answer is not None:
        prefix, status, code, length, _ = struct.unpack_from("<IHHHH", answer.data)
        assert (prefix, length) == (0x43563355, len(answer.data) - 12)
        assert status == 0 or length == 0
        assert code == struct.unpack_from("<H", data, 6)[0] + 1 & 0xFFFF
