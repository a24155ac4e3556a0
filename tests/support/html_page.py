"""A reader of pages to print that takes nothing wrong."""

from __future__ import annotations

from html.parser import HTMLParser

VOID = {"meta"}


class Strict(HTMLParser):
    """Every element is closed in its turn; remembers texts and elements."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.cells: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.elements.append(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if data.strip() and "style" not in self.open:
            self.cells.append(data.strip())

    def error(self, message):
        raise AssertionError(message)
