"""Outcomes of scripted leaves: `ok(contact=c)`, `fails("search_exhausted")`, `hangs()`, `raises(error)`, `real()`.

{"guarded_sweep": [ok() * 3, fails("search_exhausted", exhausted=True)],   # successive calls; the last one repeats
 "squeeze*": fails("no_squeeze"),                                          # every node the pattern matches
 "match": lambda call: ok() if call.number else fails()}                   # decided when it is called
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, TypeAlias, Union

from glotouch_bt.robot import ParamError

if TYPE_CHECKING:
    from glotouch_bt.mission_testing.call import Call

Kind = Literal["ok", "fails", "hangs", "raises", "real"]


@dataclass(frozen=True)
class LeafOutcome:
    """Outcome of one call of a leaf; made by `ok`, `fails`, `hangs`, `raises`, `real`.

    Attributes:
        kind: Kind of outcome.
        code: Failure code; empty: the first the skill declares.
        message: Failure message.
        ports: Values of output ports written; ports a success does not name get a stand-in value.
        error: Exception to raise.
        after_s: Robot time to run before.
    """

    kind: Kind
    code: str = ""
    message: str = ""
    ports: Mapping[str, object] = field(default_factory=dict)
    error: BaseException | None = None
    after_s: float = 0.0

    def after(self, seconds: float) -> LeafOutcome:
        """Return the same outcome after `seconds` of RUNNING on the robot's clock."""
        if not 0.0 <= seconds < float("inf"):
            raise ParamError("after.seconds", seconds, "finite and not negative; hangs() never ends")
        return replace(self, after_s=float(seconds))

    def __mul__(self, times: int) -> list[LeafOutcome]:
        return [self] * times

    __rmul__ = __mul__

    def __str__(self) -> str:
        ports = [f"{k}={v!r}" for k, v in self.ports.items()]
        first = {"fails": [repr(self.code)] if self.code else [], "raises": [repr(self.error)]}.get(self.kind, [])
        after = f".after({self.after_s:g})" if self.after_s else ""
        return f"{self.kind}({', '.join([*first, *ports])}){after}"


Decide: TypeAlias = "Callable[[Call], LeafOutcome]"
Answer: TypeAlias = Union[LeafOutcome, "Decide", "Sequence[Answer]"]
Script: TypeAlias = Mapping[str, Answer]


def ok(**ports: object) -> LeafOutcome:
    """Return SUCCESS; `ports` are written, the other output ports get stand-in values."""
    return LeafOutcome("ok", ports=ports)


def fails(code: str = "", message: str = "", /, **ports: object) -> LeafOutcome:
    """Return FAILURE with a declared code (default: the first); `ports` are written before."""
    return LeafOutcome("fails", code, message, ports)


def hangs(**ports: object) -> LeafOutcome:
    """Stay RUNNING until preempted or out of time; `ports` are written first."""
    return LeafOutcome("hangs", ports=ports)


def raises(error: BaseException) -> LeafOutcome:
    """Raise an exception in the skill."""
    return LeafOutcome("raises", error=error)


def real() -> LeafOutcome:
    """Run the real skill on the test's robot; must be the node's only outcome."""
    return LeafOutcome("real")


def flat(answer: Answer) -> tuple[LeafOutcome | Decide, ...]:
    """Flatten an answer into a row of outcomes.

    Raises:
        ParamError: It is empty, or holds something that is neither an outcome nor a function.
    """
    makers: tuple[object, ...] = (ok, fails, hangs, raises, real)
    if any(answer is maker for maker in makers):
        raise ParamError("script", getattr(answer, "__name__", answer), "called: ok(), fails('code'), ...")
    if isinstance(answer, LeafOutcome) or (callable(answer) and not isinstance(answer, type)):
        return (answer,)
    if not isinstance(answer, Sequence) or isinstance(answer, (str, bytes)) or not answer:
        raise ParamError("script", answer, "an outcome (ok(), fails('code'), ...), a function, or a list of them")
    return tuple(o for part in answer for o in flat(part))
