"""What fieldcam uses of pyusb."""

from usb.backend import IBackend

class _LibUSB(IBackend):
    lib: object
    def __init__(self, lib: object) -> None: ...

def get_backend() -> _LibUSB | None: ...
