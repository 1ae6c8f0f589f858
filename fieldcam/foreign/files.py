"""Reads a file from elsewhere, no further than its kind may be long."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from fieldcam.foreign.bounds import Bound


def read_foreign(path: Path, bound: Bound) -> bytes:
    """The whole file; raises the bound's error where it is none, cannot be read, or is too long."""
    with open_foreign(path, bound) as file:
        content = file.read(bound.most_bytes + 1)
    if len(content) > bound.most_bytes:
        raise too_large(str(path), bound)
    return content


@contextmanager
def open_foreign(path: Path, bound: Bound) -> Iterator[BinaryIO]:
    """The file, opened to be read; raises the same.

    A pipe or a device is no file: it may have no end, or never begin.
    """
    try:
        # Without O_NONBLOCK, opening a pipe waits for somebody to write into it.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        with open(descriptor, "rb") as file:  # noqa: PTH123 (it is a descriptor)
            found = os.fstat(descriptor)
            _check_kind(path, found.st_mode, bound)
            if found.st_size > bound.most_bytes:
                raise too_large(str(path), bound)
            yield file
    except FileNotFoundError as error:
        raise bound.refuse(f"There is no {bound.what} {path}.") from error
    except IsADirectoryError as error:
        raise _no_folder(path, bound) from error
    except OSError as error:
        raise bound.refuse(f"{path} cannot be read: {error.strerror}.") from error
    except ValueError as error:  # a NUL in the path
        raise bound.refuse(f"{path} cannot be read: {error}.") from error


def too_large(name: str, bound: Bound) -> Exception:
    """For readers that find out only while unpacking."""
    return bound.refuse(f"{name} is too large for {bound.one}.")


def _check_kind(path: Path, mode: int, bound: Bound) -> None:
    if stat.S_ISDIR(mode):
        raise _no_folder(path, bound)
    if not stat.S_ISREG(mode):
        raise bound.refuse(f"{path} is a pipe or a device, not a file.", "Save it as a file.")


def _no_folder(path: Path, bound: Bound) -> Exception:
    return bound.refuse(f"{path} is a folder, not {bound.one}.")
