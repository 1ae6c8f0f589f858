"""Keeps a feature file's references from going round in circles."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from fieldcam.camera.genapi.access import Access
from fieldcam.errors import FeatureFileInvalid

MOST_VISITS = 100_000
"""Of nodes, for one answer; the hungriest feature seen in a camera's file takes 1,141."""


class Visits:
    """Which questions are being worked on, each asked of one node."""

    def __init__(self) -> None:
        self._under_way: set[tuple[str, str]] = set()
        self._spent = 0
        self._known: dict[str, Access] = {}

    def access(self, node: str, work_out: Callable[[], Access]) -> Access:
        """A node's access, worked out once for each outermost question.

        A camera's nodes hang together so closely that one of them is otherwise asked
        thousands of times for the same answer. Where the question comes round to a
        node that it is already asked of, that node stands in no way: in real files a
        selector's entries depend on registers whose address depends on the selector.
        """
        if (node, "access") in self._under_way:
            return Access.READ_WRITE
        with self.visit(node, "access"):
            if node not in self._known:
                self._known[node] = work_out()
            return self._known[node]

    def forget(self) -> None:
        """Something was written: nothing that was worked out before holds."""
        self._known.clear()

    @contextmanager
    def visit(self, node: str, question: str) -> Iterator[None]:
        """Raises FeatureFileInvalid where answering needs the answer, or takes without end."""
        key = (node, question)
        if key in self._under_way:
            raise FeatureFileInvalid(f"In the camera's feature file {node} depends on itself.")
        outermost = not self._under_way
        if outermost:
            self.forget()
        self._spend(outermost, node)
        self._under_way.add(key)
        try:
            yield
        except RecursionError as error:
            if not outermost:
                raise
            raise _too_deep(node) from error
        finally:
            self._under_way.discard(key)

    def _spend(self, outermost: bool, node: str) -> None:
        self._spent = 0 if outermost else self._spent + 1
        if self._spent > MOST_VISITS:
            raise _too_deep(node)


def _too_deep(node: str) -> FeatureFileInvalid:
    return FeatureFileInvalid(f"In the camera's feature file {node} depends on too many others.")
