"""Cameras that speak USB3 Vision, in layers of which each knows only those below.

    devices    what is attached; a camera opened as a whole
    stream     frames             (transfer_plan, assembly, blocks, frames), events
    bootstrap  fixed registers    (manifest, description)
    channel    registers          (gencp)
    transport  bulk transfers     (pyusb_transport, descriptors, holders, usb_faults)

`pixels`, `clocks` and `pairing` are pure: they turn frames into pairs of images.
"""
