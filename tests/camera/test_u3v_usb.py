"""Cameras over pyusb: finding, claiming, reading in place, and what each error means."""

from __future__ import annotations

import ctypes
import errno
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import usb.backend
import usb.core

from fieldcam.camera.usb3vision.devices import (
    AttachedCamera,
    CameraNames,
    attached_cameras,
    open_attached,
)
from fieldcam.camera.usb3vision.holders import holder_of
from fieldcam.camera.usb3vision.pyusb_transport import UsbEndpoint, UsbLink, attached
from fieldcam.camera.usb3vision.transport import (
    EndpointStalled,
    LinkFault,
    LinkSpeed,
    TransferOverflow,
    TransferTimeout,
)
from fieldcam.camera.usb3vision.usb_faults import UDEV_RULE, UDEV_RULE_PATH, device_error
from fieldcam.errors import (
    CameraBusy,
    CameraForbidden,
    CameraUnplugged,
    CameraUnsupported,
    DeviceError,
    ExitCode,
    UsbLibraryMissing,
    UsbMemoryShort,
)

ROOT = Path(__file__).parents[2]
INFO = bytes((20, 0x24, 1, *[0] * 8, 4, 1, 2, 0, 0, 0, 3, 5, 8))
STRINGS = {1: "Orchard Optics", 2: "Twin", 3: "A-17", 4: "GUID-17", 5: "left eye", 6: "iProduct"}


@dataclass
class Face:
    """An interface."""

    protocol: int
    endpoints: tuple[int, ...]
    extra: bytes = b""
    usb_class: int = 0xEF
    subclass: int = 0x05


CONTROL = Face(0, (0x04, 0x85), INFO)
EVENT = Face(1, (0x86,))
STREAM = Face(2, (0x8B,))


@dataclass
class FakeDevice:
    """A device as pyusb sees it through a backend."""

    faces: tuple[Face, ...] = (CONTROL, EVENT, STREAM)
    strings: dict[int, str] = field(default_factory=lambda: dict(STRINGS))
    speed: int = 4
    address: int = 7
    configuration: int = 1
    kernel_driver: bool = False
    failing: dict[str, int] = field(default_factory=dict)
    """errno by the backend call that raises it."""
    calls: list[str] = field(default_factory=list)
    sent: bytes = b""


class FakeBackend(usb.backend.IBackend):
    """What pyusb asks of a USB library, answered without one."""

    def __init__(self, *devices: FakeDevice) -> None:
        super().__init__()
        self.devices = devices
        self.open_handles = 0

    def _call(self, device: FakeDevice, name: str, *told: object) -> None:
        device.calls.append(" ".join([name, *map(str, told)]))
        if name in device.failing:
            raise usb.core.USBError(name, None, device.failing[name])

    def enumerate_devices(self) -> Iterator[FakeDevice]:
        return iter(self.devices)

    def get_device_descriptor(self, dev: FakeDevice) -> SimpleNamespace:
        names = "bLength bDescriptorType bDeviceClass bDeviceSubClass bDeviceProtocol bcdDevice"
        return SimpleNamespace(
            **dict.fromkeys(names.split(), 0),
            bMaxPacketSize0=9,
            bcdUSB=0x300,
            idVendor=0x1AB2,
            idProduct=1,
            iManufacturer=1,
            iProduct=6,
            iSerialNumber=3,
            bNumConfigurations=1,
            bus=2,
            address=dev.address,
            port_number=1,
            port_numbers=(1, 3),
            speed=dev.speed,
        )

    def get_configuration_descriptor(self, dev: FakeDevice, config: int) -> SimpleNamespace:
        if config:
            raise IndexError(config)
        self._call(dev, "descriptor")
        names = "bLength bDescriptorType wTotalLength iConfiguration bmAttributes"
        return SimpleNamespace(
            **dict.fromkeys(names.split(), 0),
            bNumInterfaces=len(dev.faces),
            bConfigurationValue=1,
            bMaxPower=112,
            extra_descriptors=[],
        )

    def get_interface_descriptor(
        self, dev: FakeDevice, intf: int, alt: int, config: int
    ) -> SimpleNamespace:
        if alt:
            raise IndexError(alt)
        face = dev.faces[intf]
        return SimpleNamespace(
            bLength=9,
            bDescriptorType=4,
            bInterfaceNumber=intf,
            bAlternateSetting=0,
            bNumEndpoints=len(face.endpoints),
            bInterfaceClass=face.usb_class,
            bInterfaceSubClass=face.subclass,
            bInterfaceProtocol=face.protocol,
            iInterface=0,
            extra_descriptors=list(face.extra),
        )

    def get_endpoint_descriptor(
        self, dev: FakeDevice, ep: int, intf: int, alt: int, config: int
    ) -> SimpleNamespace:
        return SimpleNamespace(
            bLength=7,
            bDescriptorType=5,
            bEndpointAddress=dev.faces[intf].endpoints[ep],
            bmAttributes=2,
            wMaxPacketSize=1024,
            bInterval=0,
            bRefresh=0,
            bSynchAddress=0,
            extra_descriptors=[],
        )

    def open_device(self, dev: FakeDevice) -> FakeDevice:
        self._call(dev, "open")
        self.open_handles += 1
        return dev

    def close_device(self, dev_handle: FakeDevice) -> None:
        self.open_handles -= 1

    def get_configuration(self, dev_handle: FakeDevice) -> int:
        self._call(dev_handle, "configuration")
        return dev_handle.configuration

    def set_configuration(self, dev_handle: FakeDevice, config_value: int) -> None:
        self._call(dev_handle, "configure", config_value)
        dev_handle.configuration = config_value

    def claim_interface(self, dev_handle: FakeDevice, intf: int) -> None:
        self._call(dev_handle, "claim", intf)

    def release_interface(self, dev_handle: FakeDevice, intf: int) -> None:
        self._call(dev_handle, "release", intf)

    def is_kernel_driver_active(self, dev_handle: FakeDevice, intf: int) -> bool:
        return dev_handle.kernel_driver

    def detach_kernel_driver(self, dev_handle: FakeDevice, intf: int) -> None:
        self._call(dev_handle, "detach", intf)

    def clear_halt(self, dev_handle: FakeDevice, ep: int) -> None:
        self._call(dev_handle, "clear", hex(ep))

    def bulk_write(
        self, dev_handle: FakeDevice, ep: int, intf: int, data: array[int], timeout: int
    ) -> int:
        self._call(dev_handle, "write", hex(ep), intf, timeout)
        return len(data)

    def bulk_read(
        self, dev_handle: FakeDevice, ep: int, intf: int, buff: array[int], timeout: int
    ) -> int:
        self._call(dev_handle, "read", hex(ep), intf, timeout)
        address, length = buff.buffer_info()
        assert len(dev_handle.sent) <= length * buff.itemsize
        ctypes.memmove(address, dev_handle.sent, len(dev_handle.sent))
        return len(dev_handle.sent)

    def ctrl_transfer(
        self,
        dev_handle: FakeDevice,
        bmRequestType: int,
        bRequest: int,
        wValue: int,
        wIndex: int,
        data: array[int],
        timeout: int,
    ) -> int:
        self._call(dev_handle, "control", bmRequestType, bRequest, wValue, hex(wIndex))
        if (bmRequestType, bRequest) != (0x80, 6):
            return 0
        index = wValue & 0xFF
        text = dev_handle.strings[index].encode("utf-16-le") if index else b"\x09\x04"
        descriptor = bytes((len(text) + 2, 3)) + text
        data[: len(descriptor)] = array("B", descriptor)
        return len(descriptor)


def only(device: FakeDevice) -> AttachedCamera:
    (camera,) = attached_cameras(FakeBackend(device))
    return camera


@pytest.mark.parametrize(
    "faces",
    [
        (CONTROL, EVENT, STREAM),
        (STREAM, EVENT, CONTROL),
        (Face(0, (0x02, 0x82), usb_class=8, subclass=6), CONTROL, STREAM),
        (Face(2, (0x83,), subclass=4), CONTROL, STREAM, STREAM),
    ],
    ids=["usual", "turned round", "with storage", "with foreign ones"],
)
def test_interfaces_are_found_by_what_they_are_for(faces: tuple[Face, ...]) -> None:
    ((_, interfaces),) = attached(FakeBackend(FakeDevice(faces)))
    assert faces[interfaces.control] is CONTROL
    assert faces[interfaces.stream] is STREAM
    assert (interfaces.control_out, interfaces.control_in) == (0x04, 0x85)
    assert interfaces.stream_in == 0x8B
    assert interfaces.event_in == (0x86 if EVENT in faces else None)
    assert len(interfaces.numbers) == 2 + (EVENT in faces)


@pytest.mark.parametrize(
    "device",
    [
        FakeDevice((CONTROL, EVENT)),
        FakeDevice((STREAM,)),
        FakeDevice((Face(0, (0x04,)), STREAM)),
        FakeDevice((CONTROL, Face(2, (0x0B,)))),
        FakeDevice((Face(0, (0x04, 0x85), usb_class=3), STREAM)),
        FakeDevice(failing={"descriptor": errno.EIO}),
    ],
    ids=["no stream", "no control", "no answer", "stream out", "other class", "unreadable"],
)
def test_what_is_no_camera_is_passed_over(device: FakeDevice) -> None:
    backend = FakeBackend(device, FakeDevice(address=9))
    assert [camera.address for camera in attached_cameras(backend)] == [9]


def test_a_camera_is_listed_with_its_names_and_let_go() -> None:
    backend = FakeBackend(FakeDevice())
    (camera,) = attached_cameras(backend)
    assert camera == AttachedCamera(
        CameraNames("Orchard Optics", "Twin", "A-17", "GUID-17", "left eye"),
        usb_id=(0x1AB2, 1),
        bus=2,
        address=7,
        ports=(1, 3),
        speed=LinkSpeed.SUPER,
        max_power=112,
        trouble=None,
    )
    assert backend.open_handles == 0
    assert not [call for call in backend.devices[0].calls if call.startswith("claim")]


@pytest.mark.parametrize("extra", [b"", bytes((11,)) + INFO[1:11], INFO[:3] + bytes(17)])
def test_a_camera_without_its_descriptor_has_the_devices_names(extra: bytes) -> None:
    names = only(FakeDevice((Face(0, (0x04, 0x85), extra), STREAM))).names
    assert names == CameraNames("Orchard Optics", "iProduct", "A-17", "", "")


def test_a_descriptor_behind_the_endpoints_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    backend = FakeBackend(FakeDevice((Face(0, (0x04, 0x85)), STREAM)))
    plain = backend.get_endpoint_descriptor

    def with_extra(dev: FakeDevice, ep: int, intf: int, alt: int, config: int) -> SimpleNamespace:
        found = plain(dev, ep, intf, alt, config)
        found.extra_descriptors = list(INFO) if (intf, ep) == (0, 1) else []
        return found

    monkeypatch.setattr(backend, "get_endpoint_descriptor", with_extra)
    (camera,) = attached_cameras(backend)
    assert camera.names.guid == "GUID-17"


def test_a_camera_that_may_not_be_opened_is_listed_with_the_rule_that_helps() -> None:
    camera = only(FakeDevice(failing={"open": errno.EACCES}))
    assert camera.names == CameraNames()
    assert isinstance(camera.trouble, CameraForbidden)
    assert UDEV_RULE in camera.trouble.hint
    assert UDEV_RULE_PATH in camera.trouble.hint


def test_the_shipped_rule_is_the_one_that_is_printed() -> None:
    lines = (ROOT / "systemd" / Path(UDEV_RULE_PATH).name).read_text().splitlines()
    assert [line for line in lines if not line.startswith("#")] == [UDEV_RULE]


def test_a_camera_that_goes_while_it_is_listed_is_not_listed() -> None:
    assert attached_cameras(FakeBackend(FakeDevice(failing={"open": errno.ENODEV}))) == ()


def linked(device: FakeDevice) -> tuple[UsbLink, FakeBackend]:
    backend = FakeBackend(device)
    ((found, interfaces),) = attached(backend)
    device.calls.clear()
    return UsbLink(found, interfaces), backend


def test_all_interfaces_are_claimed_and_given_back() -> None:
    device = FakeDevice(kernel_driver=True)
    link, backend = linked(device)
    claimed = [call for call in device.calls if call.startswith(("claim", "detach"))]
    assert claimed == ["detach 0", "claim 0", "detach 1", "claim 1", "detach 2", "claim 2"]
    assert "configure 1" not in device.calls
    link.close()
    link.close()
    assert backend.open_handles == 0
    assert {"release 0", "release 1", "release 2"} <= {*device.calls}


def test_only_an_unconfigured_device_is_configured() -> None:
    device = FakeDevice(configuration=0)
    linked(device)
    assert device.calls.count("configure 1") == 1


def test_a_device_that_does_not_tell_its_configuration_is_not_reset() -> None:
    device = FakeDevice(failing={"configuration": errno.EIO})
    with pytest.raises(LinkFault):
        linked(device)
    assert "configure 1" not in device.calls


@pytest.mark.parametrize(
    ("call", "number", "leaf"),
    [
        ("claim", errno.EBUSY, CameraBusy),
        ("detach", errno.EBUSY, CameraBusy),
        ("open", errno.EACCES, CameraForbidden),
        ("claim", errno.ENODEV, CameraUnplugged),
    ],
)
def test_a_camera_that_cannot_be_claimed_is_left_closed(
    call: str, number: int, leaf: type[DeviceError]
) -> None:
    device = FakeDevice(kernel_driver=True, failing={call: number})
    backend = FakeBackend(device)
    ((found, interfaces),) = attached(backend)
    with pytest.raises(leaf) as caught:
        UsbLink(found, interfaces)
    assert backend.open_handles == 0
    assert isinstance(caught.value.__cause__, usb.core.USBError)


def test_bytes_are_read_where_the_caller_wants_them() -> None:
    device = FakeDevice(sent=b"abcde")
    link, _ = linked(device)
    frame = np.zeros(100, np.uint8)
    assert link.stream_in.read(frame[40:60], 1.5) == 5
    assert frame.tobytes() == bytes(40) + b"abcde" + bytes(55)
    assert "read 0x8b 2 1500" in device.calls


def test_a_short_patience_is_not_taken_for_an_endless_one() -> None:
    device = FakeDevice()
    link, _ = linked(device)
    link.control_in.read(np.zeros(8, np.uint8), 0.0)
    link.control_out.write(b"command", 1e-9)
    assert "read 0x85 0 1" in device.calls
    assert "write 0x4 0 1" in device.calls


def test_a_command_that_went_only_in_part_is_a_timeout(monkeypatch: pytest.MonkeyPatch) -> None:
    link, backend = linked(FakeDevice())
    monkeypatch.setattr(backend, "bulk_write", lambda *_: 3)
    with pytest.raises(TransferTimeout, match="3 of 7"):
        link.control_out.write(b"command", 1.0)


def test_an_endpoint_is_halted_and_cleared() -> None:
    device = FakeDevice()
    link, _ = linked(device)
    link.stream_in.halt()
    link.stream_in.clear_halt()
    assert device.calls[-2:] == ["control 2 3 0 0x8b", "clear 0x8b"]


@pytest.mark.parametrize(
    ("number", "leaf"),
    [
        (errno.ENODEV, CameraUnplugged),
        (errno.EIO, LinkFault),
        (errno.EOVERFLOW, TransferOverflow),
        (errno.EPIPE, EndpointStalled),
        (errno.EBUSY, CameraBusy),
        (errno.EACCES, CameraForbidden),
        (errno.ENOMEM, UsbMemoryShort),
        (errno.ETIMEDOUT, TransferTimeout),
        (errno.EINVAL, LinkFault),
        (None, LinkFault),
    ],
)
def test_each_error_number_says_what_can_be_done(
    number: int | None, leaf: type[DeviceError]
) -> None:
    error = device_error(usb.core.USBError("libusb's words", None, number))
    assert type(error) is leaf
    assert error.exit_code is ExitCode.DEVICE
    assert error.message.endswith(".")
    device = FakeDevice()
    endpoint = linked(device)[0].stream_in
    device.failing["read"] = number or 0
    with pytest.raises(leaf):
        endpoint.read(np.zeros(8, np.uint8), 1.0)


def test_what_the_library_cannot_do_is_told_as_that(monkeypatch: pytest.MonkeyPatch) -> None:
    def claim(*_: object) -> None:
        raise NotImplementedError

    backend = FakeBackend(FakeDevice())
    monkeypatch.setattr(backend, "claim_interface", claim)
    ((found, interfaces),) = attached(backend)
    with pytest.raises(CameraUnsupported, match="USB library"):
        UsbLink(found, interfaces)


def test_without_libusb_one_sentence_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def find(**_: object) -> None:
        raise usb.core.NoBackendError("No backend available")

    monkeypatch.setattr(usb.core, "find", find)
    with pytest.raises(UsbLibraryMissing, match="libusb is not installed"):
        attached_cameras()


def test_speeds_beyond_those_known_are_the_fastest() -> None:
    speeds = [only(FakeDevice(speed=speed)).speed for speed in (0, 3, 4, 5, 9)]
    assert [speed.is_usb3 for speed in speeds] == [False, False, True, True, True]


def test_a_camera_plugged_in_anew_is_not_the_one_that_was_listed() -> None:
    camera = only(FakeDevice(address=7))
    with pytest.raises(CameraUnplugged):
        open_attached(camera, FakeBackend(FakeDevice(address=8)))


def test_endpoints_are_those_of_the_descriptors() -> None:
    link, _ = linked(FakeDevice())
    assert isinstance(link.stream_in, UsbEndpoint)
    assert (link.stream_in.address, link.event_in) == (0x8B, replace(link.stream_in, address=0x86))
    assert linked(FakeDevice((CONTROL, STREAM)))[0].event_in is None


def process(root: Path, number: int, name: str, opened: str) -> None:
    folder = root / "proc" / str(number)
    (folder / "fd").mkdir(parents=True)
    (folder / "comm").write_text(f"{name}\n")
    (folder / "fd" / "5").symlink_to(opened)


def test_a_program_that_holds_a_camera_is_named(tmp_path: Path) -> None:
    process(tmp_path, 10, "other", "/dev/bus/usb/002/008")
    process(tmp_path, 20, "viewer", "/dev/bus/usb/002/007")
    (tmp_path / "proc" / "self").symlink_to("10")
    assert holder_of(2, 7, tmp_path) == "viewer (process 20)"
    assert holder_of(2, 9, tmp_path) is None
    assert holder_of(2, 8, tmp_path) is None


def test_a_kernel_driver_that_holds_a_camera_is_named(tmp_path: Path) -> None:
    for device, address, driver in (
        ("2-1", 6, "uvcvideo"),
        ("2-1.3", 7, "u3v"),
        ("2-4", 8, "usbfs"),
    ):
        interface = tmp_path / "sys/bus/usb/devices" / device / f"{device}:1.0"
        interface.mkdir(parents=True)
        (interface.parent / "devnum").write_text(f"{address}\n")
        bound = tmp_path / "drivers" / driver
        bound.mkdir(parents=True)
        (interface / "driver").symlink_to(bound)
    assert holder_of(2, 7, tmp_path) == "the kernel driver u3v"
    assert holder_of(2, 8, tmp_path) is None
    assert holder_of(3, 7, tmp_path) is None
