"""What fieldcam uses of pyusb."""

from array import array
from collections.abc import Iterable, Iterator

from usb.backend import IBackend

class USBError(OSError):
    backend_error_code: int | None
    def __init__(
        self, strerror: str, error_code: int | None = ..., errno: int | None = ...
    ) -> None: ...

class USBTimeoutError(USBError): ...
class NoBackendError(ValueError): ...

class Endpoint:
    bEndpointAddress: int
    bmAttributes: int
    wMaxPacketSize: int
    extra_descriptors: Iterable[int]

class Interface:
    bInterfaceNumber: int
    bAlternateSetting: int
    bInterfaceClass: int
    bInterfaceSubClass: int
    bInterfaceProtocol: int
    extra_descriptors: Iterable[int]
    def endpoints(self) -> tuple[Endpoint, ...]: ...
    def __iter__(self) -> Iterator[Endpoint]: ...

class Configuration:
    bConfigurationValue: int
    bMaxPower: int
    extra_descriptors: Iterable[int]
    def interfaces(self) -> tuple[Interface, ...]: ...
    def __iter__(self) -> Iterator[Interface]: ...

class Device:
    bcdUSB: int
    idVendor: int
    idProduct: int
    iManufacturer: int
    iProduct: int
    iSerialNumber: int
    bus: int | None
    address: int | None
    port_numbers: tuple[int, ...] | None
    speed: int | None
    backend: IBackend
    libusb: IBackend
    """Set by fieldcam."""
    def configurations(self) -> tuple[Configuration, ...]: ...
    def __iter__(self) -> Iterator[Configuration]: ...
    def get_active_configuration(self) -> Configuration: ...
    def set_configuration(self, configuration: Configuration | int | None = ...) -> None: ...
    def clear_halt(self, ep: int) -> None: ...
    def write(self, endpoint: int, data: bytes, timeout: int | None = ...) -> int: ...
    def read(self, endpoint: int, size_or_buffer: array[int], timeout: int | None = ...) -> int: ...
    def ctrl_transfer(
        self,
        bmRequestType: int,
        bRequest: int,
        wValue: int = ...,
        wIndex: int = ...,
        data_or_wLength: int | bytes | None = ...,
        timeout: int | None = ...,
    ) -> int: ...
    def is_kernel_driver_active(self, interface: int) -> bool: ...
    def detach_kernel_driver(self, interface: int) -> None: ...

def find(find_all: bool = ..., backend: IBackend | None = ...) -> Iterator[Device]: ...
