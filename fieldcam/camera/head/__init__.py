"""A stereo head of USB3 Vision cameras behind the port, in layers that know only those below.

    device      the head as the app uses it
    opening     which cameras are the eyes, opened and set up
    watching    the head's own shutter, and rest when nobody uses it
    eyes        one camera: set up, triggered, read
    adjusting   features by their SFNC names, and what a camera lacks

`settings` (camera.toml), `plan`, `assembly` and `pictures` are pure.
"""
