"""A USB3 Vision stereo head made of software, register by register.

It is the other side of fieldcam's driver and shares no code with it. Two front ends
put it before a host: `EmulatedBackend` under pyusb in the same process, and
`PluggedBus` (a usbfs server for umockdev's preload) under real libusb in another.
"""
