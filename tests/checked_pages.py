"""What every page of a report has to be: whole, closed, and in need of nothing else."""

from __future__ import annotations

from html.parser import HTMLParser

EMPTY = {"meta", "img", "br"}


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.sources: list[str] = []
        self.styles: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag != "script"
        if tag not in EMPTY:
            self.open.append(tag)
        self.sources += [value or "" for key, value in attrs if key in ("src", "href", "srcset")]

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [value or "" for key, value in attrs if key in ("src", "href", "srcset")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        (self.styles if self.open[-1:] == ["style"] else self.words).append(data)


def words_of(page: str) -> str:
    """The page's text; fails where the page is not well-formed or fetches anything."""
    reader = _Reader()
    reader.feed(page)
    reader.close()
    assert not reader.open
    assert all(source.startswith("data:") for source in reader.sources)
    assert "url(" not in "".join(reader.styles) and "@import" not in "".join(reader.styles)
    return " ".join(" ".join(reader.words).split())
