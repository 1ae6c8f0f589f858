"""Who may read or write a feature, and whom it is meant for."""

from __future__ import annotations

from enum import StrEnum


class Access(StrEnum):
    """What can be done with a feature, in the standard's letters."""

    NOT_IMPLEMENTED = "NI"
    """This camera does not have it."""
    NOT_AVAILABLE = "NA"
    """The camera has it, but not as it is set up now."""
    WRITE_ONLY = "WO"
    READ_ONLY = "RO"
    READ_WRITE = "RW"

    @property
    def readable(self) -> bool:
        return self in (Access.READ_ONLY, Access.READ_WRITE)

    @property
    def writable(self) -> bool:
        return self in (Access.WRITE_ONLY, Access.READ_WRITE)

    @property
    def available(self) -> bool:
        return self.readable or self.writable

    def within(self, other: Access) -> Access:
        """What both allow."""
        if Access.NOT_IMPLEMENTED in (self, other):
            return Access.NOT_IMPLEMENTED
        return _ACCESS[self.readable and other.readable, self.writable and other.writable]

    def locked(self) -> Access:
        """Without writing."""
        return self.within(Access.READ_ONLY)


_ACCESS = {
    (False, False): Access.NOT_AVAILABLE,
    (False, True): Access.WRITE_ONLY,
    (True, False): Access.READ_ONLY,
    (True, True): Access.READ_WRITE,
}


class Visibility(StrEnum):
    """Whom a feature is meant for."""

    BEGINNER = "Beginner"
    EXPERT = "Expert"
    GURU = "Guru"
    INVISIBLE = "Invisible"
