"""Opens a calibration, whichever program wrote it: as documents by the eye they are of.

A file is CameraInfo as ROS 1 and ROS 2 print or save it, OpenCV's YAML or JSON,
`ost.txt`, Kalibr's camchain, or camera_calibration's tarball, told by its content.
"""

from __future__ import annotations

import codecs
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from fieldcam.calibration.reading.documents import CalibrationDocument
from fieldcam.calibration.reading.kalibr import is_kalibr, spelt_out
from fieldcam.calibration.reading.ost_text import is_ost, ost_eyes
from fieldcam.calibration.reading.printed import one_camera, unwrapped
from fieldcam.calibration.reading.tarball import STEMS, SUFFIXES, tarball_texts
from fieldcam.calibration.reading.yaml_entries import Entry, YamlRefused, yaml_mappings
from fieldcam.errors import CalibrationInvalid
from fieldcam.foreign.bounds import CALIBRATION, TARBALL
from fieldcam.foreign.files import open_foreign, too_large

LEFT, RIGHT = "left", "right"
INTRINSICS, EXTRINSICS = "intrinsics", "extrinsics"
PAIRS = ({INTRINSICS, EXTRINSICS}, {LEFT, RIGHT})
"""Parts that make a camera together."""
WHOLE = "camera"
"""A document of a whole camera, or of one eye that does not say which."""

TAR_STARTS = (b"\x1f\x8b", b"BZh", b"\xfd7zXZ")
TAR_MAGIC_AT = 257
WIDE = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
LETTERS = 64
"""So many bytes tell by their zeros whether letters have two of them."""
AS_YAML = "Save the calibration as .yml."
AS_OPENCV = "Save M1, D1, M2, D2, R and T as OpenCV's .yml."
OTHERS = (
    (b"<", "XML", AS_YAML),
    (b"PK\x03\x04", "a zip archive, as numpy and others write", AS_OPENCV),
    (b"MATLAB", "a MATLAB file", AS_OPENCV),
    (b"\x89HDF", "an HDF5 or MATLAB file", AS_OPENCV),
    (b"\x93NUMPY", "a numpy array", AS_OPENCV),
    (b"\x80\x02", "a Python pickle, which is not opened", AS_OPENCV),
    (b"\x80\x03", "a Python pickle, which is not opened", AS_OPENCV),
    (b"\x80\x04", "a Python pickle, which is not opened", AS_OPENCV),
    (b"\x89PNG", "a picture", "Give the calibration of the camera that took it."),
    (b"\xff\xd8", "a picture", "Give the calibration of the camera that took it."),
    (b"[LEFT_CAM", "a ZED camera's settings", AS_OPENCV),
)
"""How files begin that are no calibration of these kinds, and what they are."""

Documents = Mapping[str, CalibrationDocument]
"""By the eye, or the part, that each describes."""


def open_documents(path: Path) -> Documents:
    """What a file, a tarball or a folder holds; raises CalibrationInvalid."""
    if path.is_dir():
        return _by_name(path, _folder_texts(path))
    content = _start(path)
    if content.startswith(TAR_STARTS) or content[TAR_MAGIC_AT:].startswith(b"ustar"):
        return _by_name(path, tarball_texts(path).items())
    return _parsed(path, content)


def read_document(path: Path) -> CalibrationDocument:
    """A file that describes one camera, or one eye."""
    found = tuple(open_documents(path).values())
    if len(found) != 1:
        raise CalibrationInvalid(f"{path} describes {len(found)} cameras.", "Give one file of one.")
    return found[0]


def _start(path: Path) -> bytes:
    """The whole of a text, or the beginning of an archive."""
    with open_foreign(path, TARBALL) as file:
        content = file.read(CALIBRATION.most_bytes + 1)
    if not content.strip():
        raise CalibrationInvalid(f"{path} is empty.")
    return content


def _folder_texts(folder: Path) -> Iterator[tuple[str, bytes]]:
    paths = (folder / f"{stem}{suffix}" for stem in STEMS for suffix in SUFFIXES)
    for path in paths:
        if path.is_file():
            yield path.name, _start(path)


def _by_name(path: Path, texts: Iterable[tuple[str, bytes]]) -> Documents:
    """As far as they are needed: what lies beside a whole camera may be anything."""
    found: dict[str, CalibrationDocument] = {}
    for name, content in texts:
        for part, document in _parsed(path / name, content).items():
            found.setdefault(Path(name).stem if part == WHOLE else part, document)
        if any(pair <= found.keys() for pair in PAIRS):
            break
    return found


def _parsed(path: Path, content: bytes) -> Documents:
    if len(content) > CALIBRATION.most_bytes:
        raise too_large(str(path), CALIBRATION)
    for start, what, hint in OTHERS:
        if content.lstrip().startswith(start):
            raise CalibrationInvalid(f"{path} is {what}, and no calibration.", hint)
    text = _decoded(content)
    if is_ost(text):
        return _of_eyes(path, ost_eyes(text))
    if text.startswith("%YAML"):  # OpenCV's `%YAML:1.0` is none of YAML's own
        text = text.partition("\n")[2]
    try:
        mappings = yaml_mappings(text)
    except YamlRefused as error:
        raise CalibrationInvalid(f"{path} {error}.") from error
    document = CalibrationDocument(path, one_camera(path, mappings))
    if is_kalibr(document):
        return {WHOLE: spelt_out(document)}
    return {WHOLE: CalibrationDocument(path, unwrapped(document.entries))}


def _decoded(content: bytes) -> str:
    """PowerShell's `>` writes UTF-16; only what nothing is read from may be in another code."""
    if content.startswith(WIDE):
        return content.decode("utf-16", errors="replace")
    for begin, code in ((1, "utf-16-le"), (0, "utf-16-be")):
        if content[:LETTERS] and not any(content[begin:LETTERS:2]):
            return content.decode(code, errors="replace")
    return content.decode("utf-8-sig", errors="replace")


def _of_eyes(path: Path, eyes: Mapping[str, dict[str, Entry]]) -> Documents:
    """Where there is one only, it is the whole."""
    if len(eyes) == 1:
        return {WHOLE: CalibrationDocument(path, next(iter(eyes.values())))}
    found = {}
    for name, entries in eyes.items():
        eye = next((eye for eye in (LEFT, RIGHT) if eye in name.lower()), name)
        found[eye] = CalibrationDocument(path, entries)
    return found
