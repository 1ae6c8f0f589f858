"""Files named by the SHA-256 of their content, under `objects/`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import file_digest, sha256
from pathlib import Path

from fieldcam.disk.durable import fsync_folder, storage_error, write_durably

CALIBRATION_SUFFIX = ".yml"
FACTS_SUFFIX = ".json"
"""Of what is known of a capture; all other files are images."""


@dataclass(frozen=True, slots=True)
class Objects:
    """The image files of a data folder."""

    folder: Path
    """The data folder."""

    def keep(self, content: bytes, suffix: str) -> Path:
        """Make content durable and give its file, which may have been there before.

        One that is damaged is written anew.
        """
        path = self.path(self.name(content, suffix))
        if self.is_intact(path.name):
            # Whoever wrote it may not have got as far as making its name durable.
            self._sync_name(path)
        else:
            write_durably(path, content)
        return path

    def name(self, content: bytes, suffix: str) -> str:
        """What the file of this content is called."""
        return sha256(content).hexdigest() + suffix

    def path(self, name: str) -> Path:
        """Where the file of this name lies."""
        return self.folder / "objects" / name[:2] / name

    def names(self) -> Iterator[Path]:
        """All files, temporary ones apart."""
        return (p for p in self.folder.glob("objects/*/*") if not p.name.startswith("."))

    def is_intact(self, name: str) -> bool:
        """Whether the file is there and its content is what its name says."""
        try:
            with self.path(name).open("rb") as stream:
                return file_digest(stream, "sha256").hexdigest() == name.partition(".")[0]
        except OSError:
            return False

    def is_damaged(self, name: str) -> bool:
        """Whether the file is there and its content is another one."""
        return self.path(name).exists() and not self.is_intact(name)

    def _sync_name(self, path: Path) -> None:
        try:
            fsync_folder(path.parent)
        except OSError as error:
            raise storage_error(path, error) from error
