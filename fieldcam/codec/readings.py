"""A ClusterReading as one line of JSON, and back.

The analysis writes it once, and that text is stored; arrays are unpacked only where
they are looked at. What comes back differs from what went in by at most 1/128 px of
disparity and 0.005 mm of a cloud. `schema` counts the versions of this form: an older
one is brought up to date when it is read, a newer one is refused.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import msgspec

from fieldcam.codec.forms import Form, ReadingForm, dump_form
from fieldcam.errors import ReadingInvalid
from fieldcam.values import READING_SCHEMA_VERSION, ClusterReading, Verdict

DAMAGED = "The stored reading is damaged."


@dataclass(frozen=True, slots=True, eq=False)
class EncodedReading:
    """A reading as it is stored, with its arrays packed."""

    text: str
    form: ReadingForm
    """What the text says."""

    @property
    def verdict(self) -> Verdict:
        return self.form.verdict.value()

    def decode(self) -> ClusterReading:
        """With masks, clouds and disparity; raises ReadingInvalid where these are damaged."""
        try:
            return self.form.value()
        except (OverflowError, ValueError, zlib.error) as error:
            raise ReadingInvalid(DAMAGED) from error


def dump_reading(reading: ClusterReading) -> str:
    """The text; raises ValueError where a number is not finite."""
    return dump_form(ReadingForm.of(reading))


def parse_reading(text: str) -> EncodedReading:
    """Raises ReadingInvalid where the text is no reading, or of a newer form."""
    _check_version(text)
    try:
        return EncodedReading(text, msgspec.json.decode(text, type=ReadingForm))
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise ReadingInvalid(DAMAGED) from error


def load_reading(text: str) -> ClusterReading:
    """The reading in a text; raises ReadingInvalid."""
    return parse_reading(text).decode()


class _Version(Form, frozen=True):
    schema: int


def _check_version(text: str) -> None:
    try:
        schema = msgspec.json.decode(text, type=_Version).schema
    except msgspec.ValidationError as error:
        raise ReadingInvalid("This is no stored reading.") from error
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise ReadingInvalid("The stored reading is damaged: it is no JSON.") from error
    if schema > READING_SCHEMA_VERSION:
        raise ReadingInvalid(
            f"The reading was stored by a newer fieldcam (form {schema};"
            f" this one knows forms up to {READING_SCHEMA_VERSION}).",
            "Update fieldcam on this machine.",
        )
