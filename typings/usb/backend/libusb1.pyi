"""What fieldcam uses of pyusb."""

from usb.backend import IBackend

def get_backend() -> IBackend | None: ...
