"""What a power cut can leave on a disk, after any of the recorded calls.

The model is that of ext4: fsync of a file makes its content and its name durable,
fsync of a folder makes the names in it durable, and of all else any part may be
there or not. Data survives or is lost by sectors, so a single write may be torn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from torture.traces import Call

SECTOR_BYTES = 512


@dataclass(eq=False, slots=True)
class File:
    """What is durable of a file, and what may be."""

    durable: bytes = b""
    pending: list[Patch] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Patch:
    """Bytes that were written, or the size to which a file was cut."""

    at: int
    data: bytes | None
    """None: everything from `at` on was cut off."""
    ended: int
    """Line of the trace."""


@dataclass(frozen=True, slots=True)
class Renaming:
    """A change of names in a folder."""

    removed: Path | None
    added: Path | None
    file: File | None
    """Behind the added name; None: a folder."""
    ended: int


Keep = Callable[[], bool]


class Disk:
    """Replays calls; `contents` is what could be read after a cut just now."""

    def __init__(self, root: Path) -> None:
        """Only what lies in `root` is looked at, and that name itself."""
        self._root = root
        self._names: dict[Path, File | None] = {}
        """Durable ones; None: a folder."""
        self._changes: list[Renaming] = []
        self._live: dict[Path, File | None] = {root.parent: None}
        """What running programs see."""
        self.changed = False
        """By the last call."""
        self._open: dict[int, tuple[Path, File | None, int]] = {}
        """Path, file and offset by descriptor."""

    def replay(self, call: Call) -> bytes:
        """Gives what the program wrote to its standard output."""
        self.changed = False
        if call.name == "write" and call.numbers[0] == 1:
            self.changed = True
            return call.texts[0]
        step: Callable[[Call], None] | None = getattr(self, f"_on_{call.name}", None)
        if step is not None:
            step(call)
        return b""

    def contents(self, keep: Keep) -> Iterator[tuple[Path, bytes | None]]:
        """Folders (None) and files; `keep` decides on all that is not durable."""
        names = dict(self._names)
        for change in self._changes:
            if keep():
                _rename(names, change)
        for path in sorted(names):
            file = names[path]
            yield path, None if file is None else _patched(file.durable, file.pending, keep)

    def _on_openat(self, call: Call) -> None:
        path = call.paths[-1]
        if not path.is_relative_to(self._root) and path != self._root.parent:
            return
        if path not in self._live:
            self._live[path] = made = File()
            self._changes.append(Renaming(None, path, made, call.ended))
        file = self._live[path]
        if file is not None and "O_TRUNC" in call.arguments:
            file.pending.append(Patch(0, None, call.ended))
        self._open[call.result] = (path, file, 0)

    def _on_close(self, call: Call) -> None:
        self._open.pop(call.numbers[0], None)

    def _on_lseek(self, call: Call) -> None:
        if call.numbers[0] in self._open:
            path, file, _ = self._open[call.numbers[0]]
            self._open[call.numbers[0]] = (path, file, call.result)

    def _on_write(self, call: Call) -> None:
        descriptor = call.numbers[0]
        if descriptor in self._open:
            path, file, offset = self._open[descriptor]
            self._put(file, offset, call)
            self._open[descriptor] = (path, file, offset + call.result)

    def _on_pwrite64(self, call: Call) -> None:
        if call.numbers[0] in self._open:
            self._put(self._open[call.numbers[0]][1], call.numbers[-1], call)

    def _put(self, file: File | None, offset: int, call: Call) -> None:
        assert file is not None
        self.changed = True
        file.pending.append(Patch(offset, call.texts[-1][: call.result], call.ended))

    def _on_ftruncate(self, call: Call) -> None:
        if call.numbers[0] in self._open:
            _, file, _ = self._open[call.numbers[0]]
            assert file is not None
            self.changed = True
            file.pending.append(Patch(call.numbers[-1], None, call.ended))

    def _on_fsync(self, call: Call) -> None:
        if call.numbers[0] not in self._open:
            return
        self.changed = True
        path, file, _ = self._open[call.numbers[0]]
        if file is None:
            self._settle(lambda change: path in _folders(change) and change.ended < call.began)
            return
        covered = [patch for patch in file.pending if patch.ended < call.began]
        file.durable = _patched(file.durable, covered, lambda: True)
        file.pending = [patch for patch in file.pending if patch not in covered]
        self._settle(lambda change: change.file is file and change.removed is None)

    _on_fdatasync = _on_fsync

    def _on_rename(self, call: Call) -> None:
        old, new = call.paths
        if old not in self._live:
            return
        self._live[new] = self._live.pop(old)
        self._changes.append(Renaming(old, new, self._live[new], call.ended))

    def _on_unlink(self, call: Call) -> None:
        if self._live.pop(call.paths[0], None) is not None:
            self._changes.append(Renaming(call.paths[0], None, None, call.ended))

    def _on_mkdir(self, call: Call) -> None:
        if call.paths[0].is_relative_to(self._root):
            self._live[call.paths[0]] = None
            self._changes.append(Renaming(None, call.paths[0], None, call.ended))

    def _settle(self, durable: Callable[[Renaming], bool]) -> None:
        """Changes of one name become durable in their order."""
        for change in [change for change in self._changes if durable(change)]:
            names = _names(change)
            while change in self._changes:
                first = next(each for each in self._changes if names & _names(each))
                _rename(self._names, first)
                self._changes.remove(first)


def some(chance: Random, share: float) -> Keep:
    """Keeps this share of what is not durable."""
    return lambda: chance.random() < share


def _names(change: Renaming) -> set[Path]:
    return {path for path in (change.removed, change.added) if path is not None}


def _folders(change: Renaming) -> set[Path]:
    return {path.parent for path in _names(change)}


def _rename(names: dict[Path, File | None], change: Renaming) -> None:
    if change.removed is not None:
        names.pop(change.removed, None)
    if change.added is not None:
        names[change.added] = change.file


def _patched(durable: bytes, patches: Iterable[Patch], keep: Keep) -> bytes:
    content = bytearray(durable)
    for patch in patches:
        if patch.data is None:
            if keep():
                del content[patch.at :]
                content.extend(bytes(patch.at - len(content)))
            continue
        for start in range(0, len(patch.data), SECTOR_BYTES):
            if keep():
                _overwrite(content, patch.at + start, patch.data[start : start + SECTOR_BYTES])
    return bytes(content)


def _overwrite(content: bytearray, at: int, data: bytes) -> None:
    content.extend(bytes(max(0, at - len(content))))
    content[at : at + len(data)] = data
