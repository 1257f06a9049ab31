"""The thread that computes for all pages: what is overtaken is dropped, and errors are messages."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import partial

import pytest

from designer import InputError
from designer.explorer.wire import Message
from designer.explorer.work_queue import DEFECT, WorkQueue


class Heard:
    """Messages in their order, and a way to wait for one."""

    def __init__(self) -> None:
        self.messages: list[Message] = []
        self._change = threading.Condition()

    def __call__(self, message: Message) -> None:
        with self._change:
            self.messages.append(message)
            self._change.notify_all()

    def wait(self, count: int) -> list[Message]:
        with self._change:
            assert self._change.wait_for(lambda: len(self.messages) >= count, 20.0)
        return self.messages


@pytest.fixture
def queue() -> Iterator[WorkQueue]:
    defects: list[BaseException] = []
    made = WorkQueue(defects.append)
    yield made
    made.close()


def counting(count: int) -> Iterator[Message]:
    return ({"kind": "piece", "k": k} for k in range(count))


def test_all_messages_of_an_answer_arrive_in_order(queue: WorkQueue) -> None:
    heard = Heard()
    queue.ask("page", 7, lambda: counting(4), heard)
    assert [m["k"] for m in heard.wait(4)] == [0, 1, 2, 3]
    assert {m["id"] for m in heard.messages} == {7}
    assert [m["first"] for m in heard.messages] == [True, False, False, False]


def test_what_is_overtaken_is_never_begun(queue: WorkQueue) -> None:
    heard, begun, gate, entered = Heard(), list[int](), threading.Event(), threading.Event()

    def slow() -> Iterator[Message]:
        entered.set()
        gate.wait(20.0)
        yield {"kind": "piece", "k": 0}

    def of(number: int) -> Iterator[Message]:
        begun.append(number)
        yield {"kind": "piece", "k": number}

    queue.ask("page", 0, slow, heard)
    assert entered.wait(20.0)
    for number in (1, 2, 3):
        queue.ask("page", number, lambda number=number: of(number), heard)  # type: ignore[misc]
    gate.set()
    heard.wait(2)
    assert begun == [3]
    assert [m["id"] for m in heard.messages] == [0, 3]


def test_an_overtaken_answer_goes_no_further(queue: WorkQueue) -> None:
    heard, run = Heard(), list[int]()

    def endless() -> Iterator[Message]:
        while True:
            run.append(1)
            yield {"kind": "piece"}

    queue.ask("page", 1, endless, heard)
    heard.wait(3)
    queue.ask("page", 2, lambda: counting(1), heard)
    while heard.messages[-1]["id"] != 2:
        heard.wait(len(heard.messages) + 1)
    before = len(run)
    queue.ask("page", 3, lambda: counting(2), heard)
    heard.wait(len(heard.messages) + 1)
    assert len(run) == before


def test_two_pages_are_served_in_turn_and_first_pictures_before_the_rest(queue: WorkQueue) -> None:
    first, second = Heard(), Heard()
    gate, order = threading.Event(), list[str]()

    def answered(page: str, heard: Heard, message: Message) -> None:
        order.append(page)
        heard(message)

    def long() -> Iterator[Message]:
        for k in range(200):
            if k == 2:
                gate.wait(20.0)
            yield {"kind": "piece", "k": k}

    queue.ask("one", 1, long, partial(answered, "one", first))
    first.wait(2)
    queue.ask("two", 1, lambda: counting(1), partial(answered, "two", second))
    gate.set()
    first.wait(200)
    second.wait(1)
    assert order.index("two") <= 3


def test_a_newer_question_on_one_topic_leaves_the_other_and_comes_before_it(
    queue: WorkQueue,
) -> None:
    heard, order, gate = Heard(), list[str](), threading.Event()

    def of(topic: str, count: int) -> Iterator[Message]:
        for k in range(count):
            if topic == "map" and k == 2:
                gate.wait(20.0)
            order.append(topic)
            yield {"kind": topic}

    queue.ask("page", 1, lambda: of("map", 20), heard, "map")
    heard.wait(2)
    queue.ask("page", 2, lambda: of("view", 3), heard)
    gate.set()
    heard.wait(23)
    assert order.index("view") <= 3
    assert order.count("map") == 20


def test_an_error_is_a_message_and_the_next_question_is_answered(queue: WorkQueue) -> None:
    heard = Heard()

    def refuse() -> Iterator[Message]:
        raise InputError(None, "zeta", -1, "> 0")

    def defect() -> Iterator[Message]:
        raise ZeroDivisionError("secret")

    queue.ask("page", 1, refuse, heard)
    assert "zeta" in heard.wait(1)[0]["text"]
    queue.ask("page", 2, defect, heard)
    assert heard.wait(2)[1]["text"] == DEFECT
    queue.ask("page", 3, lambda: counting(1), heard)
    assert heard.wait(3)[2]["kind"] == "piece"
