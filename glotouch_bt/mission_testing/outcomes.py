"""What a scripted leaf answers: `ok(contact=c)`, `fails("search_exhausted")`, `hangs()`, `raises(error)`, `real()`.

{"guarded_sweep": [ok() * 3, fails("search_exhausted", exhausted=True)],   # call after call; the last one repeats
 "squeeze*": fails("no_squeeze"),                                          # every node the pattern fits
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
class Outcome:
    """How one call of a leaf goes; made by `ok`, `fails`, `hangs`, `raises`, `real`.

    Attributes:
        kind: What it does.
        code: Failure code; empty: the first the skill declares.
        message: Failure message.
        ports: Values of output ports written; ports a success does not name get a stand-in value.
        error: What is raised.
        after_s: Robot time it runs before that.
    """

    kind: Kind
    code: str = ""
    message: str = ""
    ports: Mapping[str, object] = field(default_factory=dict)
    error: BaseException | None = None
    after_s: float = 0.0

    def after(self, seconds: float) -> Outcome:
        """The same, but RUNNING for so long on the robot's clock first."""
        if not 0.0 <= seconds < float("inf"):
            raise ParamError("after.seconds", seconds, "finite and not negative; hangs() runs for ever")
        return replace(self, after_s=float(seconds))

    def __mul__(self, times: int) -> list[Outcome]:
        return [self] * times

    __rmul__ = __mul__

    def __str__(self) -> str:
        ports = [f"{k}={v!r}" for k, v in self.ports.items()]
        first = {"fails": [repr(self.code)] if self.code else [], "raises": [repr(self.error)]}.get(self.kind, [])
        after = f".after({self.after_s:g})" if self.after_s else ""
        return f"{self.kind}({', '.join([*first, *ports])}){after}"


Decide: TypeAlias = "Callable[[Call], Outcome]"
Answer: TypeAlias = Union[Outcome, "Decide", "Sequence[Answer]"]
Script: TypeAlias = Mapping[str, Answer]


def ok(**ports: object) -> Outcome:
    """SUCCESS; `ports` are written, and stand-in values to the other output ports."""
    return Outcome("ok", ports=ports)


def fails(code: str = "", message: str = "", /, **ports: object) -> Outcome:
    """FAILURE with a code the skill declares (default: its first); `ports` are written before."""
    return Outcome("fails", code, message, ports)


def hangs(**ports: object) -> Outcome:
    """RUNNING until a timeout, a sibling, the skill's own longest time or the mission's end; `ports` written first."""
    return Outcome("hangs", ports=ports)


def raises(error: BaseException) -> Outcome:
    """A fault in the skill."""
    return Outcome("raises", error=error)


def real() -> Outcome:
    """The skill itself, on the robot the test gives; must be all a node is scripted with."""
    return Outcome("real")


def flat(answer: Answer) -> tuple[Outcome | Decide, ...]:
    """An answer as the row of its outcomes, nested rows laid out.

    Raises:
        ParamError: Something in it is neither an outcome nor a function, or there is nothing in it.
    """
    makers: tuple[object, ...] = (ok, fails, hangs, raises, real)
    if any(answer is maker for maker in makers):
        raise ParamError("script", getattr(answer, "__name__", answer), "called: ok(), fails('code'), ...")
    if isinstance(answer, Outcome) or (callable(answer) and not isinstance(answer, type)):
        return (answer,)
    if not isinstance(answer, Sequence) or isinstance(answer, (str, bytes)) or not answer:
        raise ParamError("script", answer, "an outcome (ok(), fails('code'), ...), a function, or a list of them")
    return tuple(o for part in answer for o in flat(part))
