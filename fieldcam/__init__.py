"""fieldcam: sizes of tagged apple fruitlet clusters from a flash stereo camera."""

__version__ = "0.1.0"
