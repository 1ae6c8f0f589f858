"""Keeps a feature file's references from going round in circles."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar, cast

from fieldcam.camera.genapi.access import Access
from fieldcam.errors import CameraRefused, FeatureFileInvalid
from fieldcam.foreign.bounds import MAX_VISITS

Found = TypeVar("Found")

SETTING = "setting"
"""The question whose answer is a write."""
CHARACTERS_A_VISIT = 40
"""Of a formula: evaluating so many takes as long as a visit."""


class Visits:
    """Which questions are being worked on, each asked of one node, and what was found out.

    A camera's nodes hang together so closely that one of them is otherwise asked thousands
    of times for the same answer; in a file made for it, more often than anybody can wait.
    Answers hold for one outermost question.
    """

    def __init__(self) -> None:
        self._under_way: set[tuple[str, str]] = set()
        self._spent = 0
        self._known: dict[tuple[str, str], object] = {}

    def answer(self, node: str, question: str, work_out: Callable[[], Found]) -> Found:
        """Worked out once for each outermost question; raises as `visit` does."""
        key = (node, question)
        if not self._under_way or key not in self._known:
            with self.visit(node, question):
                self._known[key] = found = work_out()
                return found
        return cast(Found, self._known[key])

    def access(self, node: str, work_out: Callable[[], Access]) -> Access:
        """A node's access.

        Where the question comes round to a node that it is already asked of, that node
        stands in no way: in real files a selector's entries depend on registers whose
        address depends on the selector.
        """
        if (node, "access") in self._under_way:
            return Access.READ_WRITE
        return self.answer(node, "access", work_out)

    def forget(self) -> None:
        """Something was written: nothing that was worked out before holds."""
        self._known.clear()

    @contextmanager
    def visit(self, node: str, question: str) -> Iterator[None]:
        """Raises FeatureFileInvalid where answering needs the answer, or takes without end.

        What the camera refuses is told of the feature that was asked for: of its register
        nobody knows more than an address.
        """
        key = (node, question)
        if key in self._under_way:
            raise FeatureFileInvalid(f"In the camera's feature file {node} depends on itself.")
        outermost = not self._under_way
        if outermost:
            self.forget()
            self._spent = 0
        self._spend(node, 1)
        self._under_way.add(key)
        try:
            yield
        except RecursionError as error:
            if not outermost:
                raise
            raise _too_deep(node) from error
        except CameraRefused as error:
            if not outermost:
                raise
            raise _refused(node, question, error) from error
        finally:
            self._under_way.discard(key)

    def charge(self, node: str, characters: int) -> None:
        """For a formula that is evaluated; raises as `visit` does."""
        self._spend(node, 1 + characters // CHARACTERS_A_VISIT)

    def _spend(self, node: str, visits: int) -> None:
        self._spent += visits
        if self._spent > MAX_VISITS:
            raise _too_deep(node)


def _refused(node: str, question: str, error: CameraRefused) -> CameraRefused:
    if not error.why:
        return CameraRefused(f"{node}: {error.message}", error.hint)
    done = "set" if question == SETTING else "tell"
    return CameraRefused(
        f"The camera refused to {done} {node}: {error.why}.", error.hint, error.why
    )


def _too_deep(node: str) -> FeatureFileInvalid:
    return FeatureFileInvalid(f"In the camera's feature file {node} depends on too many others.")
