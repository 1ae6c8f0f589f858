"""Cameras that speak USB3 Vision, in layers of which each knows only the one below.

    devices    what is attached; opening a camera as a whole
    stream     frames                            (assembly, packets, plan, frames)
    bootstrap  the camera's fixed registers      (manifest, description)
    channel    registers over GenCP              (gencp)
    transport  bulk transfers                    (pyusb_transport, descriptors, usb_faults)

`pixels` and `pairing` are pure: they turn received blocks into pairs of images.
"""
