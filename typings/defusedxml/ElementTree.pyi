"""What fieldcam uses of defusedxml."""

from collections.abc import Iterator, Sequence
from xml.etree.ElementTree import Element

def iterparse(
    source: object, events: Sequence[str], *, forbid_dtd: bool = ...
) -> Iterator[tuple[str, Element]]: ...
