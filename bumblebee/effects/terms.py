"""Terms of a discovered effect: small formulas in a joint's own quantities, read from text and evaluated on arrays.

`coefficient * term` is a torque [N m] (a force [N] on a slide) that the joint gets beside what the model has. A term
may use these names, each an array (n,) over worlds:

| name | meaning |
|---|---|
| `q`, `v` | the joint's position [rad], velocity [rad/s] |
| `q[name]`, `v[name]`, `tau[name]` | those of another joint; a name that is no word goes in quotes |
| `u` | the servo's target [rad], or the commanded torque [N m] |
| `tau` | the servo's torque [N m] |
| `t` | time since the rollout began [s] |
| `rested(T, d)` | 0 to 1: how long the joint has rested, see `sim.effects.states` |
| `slewed(r, T)` | the target at a limited rate r [rad/s], moved every T seconds |

and `+ - * / ^`, numbers, `sin cos exp tanh sign abs relu`, `stair(x, s)`: x rounded to multiples of s, `bound(x, b)`: x
kept between -b and b, and `curve(x, x0, y0, x1, y1, ...)`: straight lines between points, constant beyond them. A term
with `u` in it acts in the drive, whose limit holds for its torque and the term's together. `friction(term)` alone is
dry friction: not a torque but a loss that the solver opposes to the motion and that can hold the joint still. The
losses of a joint, each `coefficient * term`, add up with the one that it has; there is none where the sum is negative.
"""

import ast
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from bumblebee.errors import BadInput

OWN = ("q", "v", "u", "tau", "t")
QUOTED = re.compile(r"""'(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*\"""")
"""A joint's name in a term's text that is no word."""
TABLE = re.compile(rf"""curve\(((?:{QUOTED.pattern}|[^'"])+?)((?:, [-+.\de]+)+)\)""")
"""A curve in a term's text: its quantity, and its points as numbers with commas before them."""
_LONGEST = 2000  # characters
_DEEPEST = 100  # levels: a term is evaluated by a function that calls itself
_FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "sin": np.sin,
    "cos": np.cos,
    "exp": lambda x: np.exp(np.minimum(x, 50.0)),
    "tanh": np.tanh,
    "sign": np.sign,
    "abs": np.abs,
    "relu": lambda x: np.maximum(x, 0.0),
}
_SHAPED: dict[str, Callable[[Any, float], Any]] = {
    "stair": lambda x, s: s * np.round(x / s),
    "bound": lambda x, b: np.clip(x, -b, b),
}
STATES = ("rested", "slewed")  # of two numbers each
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / np.where(np.abs(b) > 1e-12, b, 1e-12),
    ast.Pow: lambda a, b: a**b,
}


@dataclass(frozen=True, eq=False)
class Term:
    """One formula, ready to be evaluated."""

    text: str
    rubs: bool
    """Whether it is dry friction, a loss instead of a torque."""
    others: tuple[str, ...]
    """Names of the other joints that it uses."""
    names: frozenset[str]
    """Those of the joint's own names that it uses."""
    states: tuple[tuple[str, tuple[float, ...]], ...]
    """States that it remembers: (name in `values`, numbers)."""
    _tree: ast.expr

    @property
    def drives(self) -> bool:
        """Whether it acts in the drive, on what is asked of it, before the drive's limit: it speaks of the target."""
        return not self.rubs and "u" in self.names

    def __call__(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """The term's value (n,); `values` has q, v, u, tau, t, and of other joints' and states what is used."""
        return np.asarray(_value(self._tree, values))


@lru_cache(maxsize=1 << 15)
def read_term(text: str) -> Term:
    """Parse a term; a formula that uses anything but the names, functions and signs above is a `BadInput`."""
    try:
        if len(text) > _LONGEST:
            raise ValueError(f"{len(text)} characters")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Python's own about formulas such as 1(q), which are refused below
            plain = re.sub(rf"({QUOTED.pattern})|\^", lambda found: found[1] or "**", text)
            tree = ast.parse(plain, mode="eval").body
        rubs = False
        if isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name) and tree.func.id == "friction":
            rubs = True
            if tree.keywords:
                raise ValueError("friction of something named")
            (tree,) = tree.args
        others: list[str] = []
        _check(tree, others)
    except (ValueError, SyntaxError, RecursionError, MemoryError, OverflowError) as error:
        names = ", ".join((*OWN, *_FUNCTIONS, *_SHAPED, *STATES, "curve", "friction"))
        raise BadInput(f"term {text[:60]!r}", f"a formula of {names}", str(error)[:80]) from None
    nodes = list(ast.walk(tree))
    inside = {id(part) for n in nodes if isinstance(n, ast.Subscript) for part in (n.value, n.slice)}
    used = {n.id for n in nodes if isinstance(n, ast.Name) and n.id in OWN and id(n) not in inside}
    calls = [n for n in nodes if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)]
    states = {_state(n): tuple(_number(a) for a in n.args) for n in calls if _name(n) in STATES}
    return Term(text, rubs, tuple(dict.fromkeys(others)), frozenset(used), tuple(states.items()), tree)


def _check(node: ast.expr, others: list[str], depth: int = 0) -> None:
    """Raise ValueError on anything that is not in the language; collect other joints' names."""
    if depth > _DEEPEST:
        raise ValueError(f"more than {_DEEPEST} levels of nesting")
    if isinstance(node, ast.Constant):
        _number(node)
    elif isinstance(node, ast.Name):
        if node.id not in OWN:
            raise ValueError(f"the name {node.id}")
    elif isinstance(node, ast.Subscript):
        others.append(_other(node))
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        _check(node.operand, others, depth + 1)
    elif isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        _check(node.left, others, depth + 1)
        _check(node.right, others, depth + 1)
        if isinstance(node.op, ast.Pow) and not (isinstance(node.right, ast.Constant) and node.right.value in range(9)):
            raise ValueError("a power that is no whole number from 0 to 8")
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        _check_call(node.func.id, node.args, others, depth + 1)
    else:
        raise ValueError(type(node).__name__)


def _check_call(name: str, arguments: list[ast.expr], others: list[str], depth: int) -> None:
    if name == "curve":
        if len(arguments) < 5 or len(arguments) % 2 == 0:
            raise ValueError("curve without x and at least two points")
        points = [_number(a) for a in arguments[1:]]
        if any(b <= a for a, b in zip(points[::2], points[2::2], strict=False)):
            raise ValueError("curve whose points do not ascend")
        arguments = arguments[:1]
    elif name in STATES:
        if len(arguments) != 2 or min(_number(a) for a in arguments) <= 0:
            raise ValueError(f"{name} without two positive numbers")
        arguments = []
    elif name in _SHAPED:
        if len(arguments) != 2 or _number(arguments[1]) <= 0:
            raise ValueError(f"{name} without a quantity and a positive number")
        arguments = arguments[:1]
    elif name not in _FUNCTIONS or len(arguments) != 1:
        raise ValueError(f"the function {name} of {len(arguments)}")
    for argument in arguments:
        _check(argument, others, depth)


def _name(node: ast.Call) -> str:
    return node.func.id if isinstance(node.func, ast.Name) else ""


def _state(node: ast.Call) -> str:
    """How a state is called in `values`."""
    assert isinstance(node.func, ast.Name)
    return f"{node.func.id}({', '.join(f'{_number(a):g}' for a in node.args)})"


def _number(node: ast.expr) -> float:
    sign = 1.0
    while isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        sign, node = -sign, node.operand
    if not isinstance(node, ast.Constant) or not isinstance(node.value, int | float) or isinstance(node.value, bool):
        raise ValueError("no number where one must be")
    if abs(node.value) > 1e9:
        raise ValueError("a number of more than 1e9")
    return sign * float(node.value)


def _other(node: ast.Subscript) -> str:
    name = node.slice
    if not isinstance(node.value, ast.Name) or node.value.id not in ("q", "v", "tau"):
        raise ValueError("brackets behind anything but q, v and tau")
    if isinstance(name, ast.Name):
        return name.id
    if isinstance(name, ast.Constant) and isinstance(name.value, str):
        return name.value
    raise ValueError("brackets around anything but a joint's name")


def _value(node: ast.expr, values: Mapping[str, np.ndarray]) -> Any:
    if isinstance(node, ast.Constant):
        return float(node.value)  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        return values[node.id]
    if isinstance(node, ast.Subscript):
        return values[f"{node.value.id}[{_other(node)}]"]  # type: ignore[attr-defined]
    if isinstance(node, ast.UnaryOp):
        inner = _value(node.operand, values)
        return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.BinOp):
        return _BINARY[type(node.op)](_value(node.left, values), _value(node.right, values))
    assert isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    if node.func.id in STATES:
        return values[_state(node)]
    if node.func.id == "curve":
        points = [_number(a) for a in node.args[1:]]
        return np.interp(_value(node.args[0], values), points[::2], points[1::2])
    if node.func.id in _SHAPED:
        return _SHAPED[node.func.id](_value(node.args[0], values), _number(node.args[1]))
    return _FUNCTIONS[node.func.id](_value(node.args[0], values))
