"""What fieldcam uses of pyusb."""

from usb import backend as backend
from usb import core as core
from usb import util as util
