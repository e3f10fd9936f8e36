"""A function in a process of its own, which may die of what it does."""

from __future__ import annotations

import faulthandler
import json
import os
import resource
import signal
from collections.abc import Callable
from typing import Any

LONGEST_S = 20.0  # of its processor time
EXCEPTION, HANG = "exception", "hang"


def answer_of(function: Callable[[], dict[str, Any]]) -> dict[str, Any] | str:
    """What it returns, or how it ended: EXCEPTION by a signal, HANG when it went on for ever.

    The child sees everything as it stands here; nothing that it changes comes back.
    """
    here, there = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(here)
        _child(function, there)
    os.close(there)
    with os.fdopen(here, "rb") as pipe:
        text = pipe.read()
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return HANG if os.WTERMSIG(status) == signal.SIGVTALRM else EXCEPTION
    answer: dict[str, Any] = json.loads(text)
    if "error" in answer:
        raise RuntimeError(answer["error"])
    return answer


def _child(function: Callable[[], dict[str, Any]], pipe: int) -> None:
    try:
        faulthandler.disable()  # how it ends is the answer, not news
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST_S)
        text = json.dumps(function())
    except BaseException as error:  # it must not return into the parent's program
        text = json.dumps({"error": repr(error)})
    with os.fdopen(pipe, "wb") as out:
        out.write(text.encode())
    os._exit(0)
