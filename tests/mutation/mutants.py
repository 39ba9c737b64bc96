"""Small faults put into a module's source, one at a time.

A mutant is named by its function and by what became of what, not by its line, so that a name stays
while lines move. Annotations and docstrings are left alone: they do nothing.
"""

from __future__ import annotations

import ast
import copy
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

__all__ = ["PACKAGE", "Mutant", "mutants", "title", "unchanged"]

PACKAGE = Path(__file__).parents[2] / "src/rigidimeter"

STOP_PATHS = {
    PACKAGE / "rig/devices/cia402/drive.py": (
        *("Cia402Drive._check_watchdog", "Cia402Drive._find_cause", "Cia402Drive._halt"),
        *("Cia402Drive.stop", "Cia402Drive.disable", "Cia402Drive.close"),
    ),
    PACKAGE / "rig/devices/ascii/drive.py": (
        *("AsciiDrive._check_horizon", "AsciiDrive._try"),
        *("AsciiDrive.stop", "AsciiDrive.disable", "AsciiDrive.close"),
    ),
    PACKAGE / "rig/devices/composed.py": (
        *("ComposedRig.stop", "ComposedRig.disable", "ComposedRig.close"),
    ),
    PACKAGE / "rig/devices/enable_line.py": (
        *("SerialEnableLine.close_contact", "SerialEnableLine.open_contact"),
        "SerialEnableLine.close",
    ),
}
"""Of the drivers, the functions that bring a rig to rest or take its power."""


@dataclass(frozen=True)
class Mutant:
    """One fault: the module it is in, its name, and the source that has it."""

    path: Path
    name: str
    source: str


COMPARISONS = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
FUNCTIONS = {"min": "max", "max": "min", "ceil": "floor", "abs": "float"}


def unchanged(path: Path) -> Mutant:
    """Return the module as it is, under its own name."""
    return Mutant(path, title(path), path.read_text(encoding="utf-8"))


def title(path: Path) -> str:
    """Return the name of a module; two drivers have one called the same."""
    devices = PACKAGE / "rig" / "devices"
    return str(path.relative_to(devices)) if path.is_relative_to(devices) else path.name


def mutants(path: Path, wanted: Callable[[str], bool] = lambda _: True) -> Iterator[Mutant]:
    """Yield every mutant whose name is wanted; making the others' source would take time.

    Of a module, or of those of its functions that stop a rig.
    """
    functions = STOP_PATHS.get(path)
    tree = ast.parse(path.read_text(encoding="utf-8"))
    seen: Counter[str] = Counter()
    for parent, field, index, node, where in list(_places(tree, "")):
        if functions is not None and where not in functions:
            continue
        for changed in _changes(node):
            name = f"{title(path)} {where}: {_text(node)} → {_text(changed)}"
            seen[name] += 1
            if seen[name] > 1:
                name += f" #{seen[name]}"
            if not wanted(name):
                continue
            _put(parent, field, index, changed)
            source = ast.unparse(ast.fix_missing_locations(tree))
            _put(parent, field, index, node)
            yield Mutant(path, name, source)


def _text(node: ast.AST) -> str:
    if isinstance(node, ast.If):
        return f"if {ast.unparse(node.test)}: ..."
    return ast.unparse(node).split("\n")[0]


def _put(parent: ast.AST, field: str, index: int | None, node: ast.AST) -> None:
    if index is None:
        setattr(parent, field, node)
    else:
        getattr(parent, field)[index] = node


def _places(node: ast.AST, where: str) -> Iterator[tuple[ast.AST, str, int | None, ast.AST, str]]:
    """Yield parent, field, index, node and function of everything that does something."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        where = f"{where}.{node.name}" if where else node.name
    for field, value in ast.iter_fields(node):
        if field in {"annotation", "returns", "decorator_list", "bases"}:
            continue
        children = value if isinstance(value, list) else [value]
        for index, child in enumerate(children):
            if not isinstance(child, ast.AST) or _does_nothing(child):
                continue
            yield node, field, index if isinstance(value, list) else None, child, where
            yield from _places(child, where)


def _does_nothing(node: ast.AST) -> bool:
    """Whether it is a docstring, an import, the names a star would import, or a type's name."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        return True
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return True
    return isinstance(node, ast.Assign) and (
        ast.unparse(node.targets[0]) == "__all__"
        or ast.unparse(node.value).startswith(("Callable[", "NDArray[", "tuple["))
    )


def _changes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what a node could wrongly be."""
    match node:
        case ast.Compare():
            for i, operator in enumerate(node.ops):
                for other in COMPARISONS[type(operator)]:
                    yield _with(node, ops=[*node.ops[:i], other(), *node.ops[i + 1 :]])
        case ast.BinOp() if type(node.op) in OPERATORS:
            yield _with(node, op=OPERATORS[type(node.op)]())
        case ast.AugAssign() if type(node.op) in OPERATORS:
            yield _with(node, op=OPERATORS[type(node.op)]())
            yield ast.Pass()
        case ast.BoolOp():
            yield _with(node, op=ast.Or() if isinstance(node.op, ast.And) else ast.And())
            yield from node.values
        case ast.UnaryOp():
            yield node.operand
        case ast.Constant():
            yield from _other_constants(node)
        case ast.IfExp():
            yield _with(node, body=node.orelse, orelse=node.body)
            yield node.body
            yield node.orelse
        case ast.If():
            yield _with(node, test=ast.UnaryOp(ast.Not(), node.test))
            yield _with(node, test=ast.Constant(False))
            yield _with(node, test=ast.Constant(True))
        case ast.Return(value=ast.Constant(value=False | None)):
            pass  # nothing is the same, or as untrue; False itself is changed
        case ast.Return() if node.value is not None:
            yield _with(node, value=ast.Constant(None))
        case ast.Assign() | ast.Raise():
            yield ast.Pass()
        case ast.Expr(value=ast.Call()):  # an action that is left out
            yield ast.Pass()
        case ast.AnnAssign() if node.value is not None:
            yield _with(node, value=ast.Constant(-1))
        case ast.Call():
            yield from _other_calls(node)
        case ast.Attribute(value=ast.Name(id="Cause" | "Limited" | "Reaction")):
            yield from _other_members(node)


def _other_constants(node: ast.Constant) -> Iterator[ast.AST]:
    match node.value:
        case bool():
            yield ast.Constant(not node.value)
        case int():
            yield ast.Constant(node.value + 1)
            yield ast.Constant(node.value - 1)
        case float():
            yield ast.Constant(node.value * 1.01 if node.value else 1e-3)
            yield ast.Constant(node.value / 1.01 if node.value else -1e-3)


def _other_calls(node: ast.Call) -> Iterator[ast.AST]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
    if name == "int" and isinstance(node.args[0], ast.Call):  # elsewhere it names a member's number
        yield _with(node, func=ast.parse("math.ceil", mode="eval").body)
    if name in FUNCTIONS:
        other: ast.expr = ast.Name(FUNCTIONS[name], ast.Load())
        if isinstance(node.func, ast.Attribute):
            other = ast.Attribute(node.func.value, FUNCTIONS[name], ast.Load())
        yield _with(node, func=other)
    if name in {"min", "max"}:  # the order makes no difference to these; each alone does
        yield from node.args
    else:
        for i in range(len(node.args) - 1):
            swapped = [*node.args]
            swapped[i : i + 2] = reversed(node.args[i : i + 2])
            if ast.dump(swapped[i]) != ast.dump(node.args[i]):
                yield _with(node, args=swapped)


OTHER_MEMBERS = {
    "Cause": ("NONE", "SOFTWARE"),
    "Limited": ("NOT", "LATCHED"),
    "Reaction": ("NONE", "CUT"),
}


def _other_members(node: ast.Attribute) -> Iterator[ast.AST]:
    """Yield two others of an enumeration, so that one is another whatever is meant."""
    for name in OTHER_MEMBERS[ast.unparse(node.value)]:
        if name != node.attr:
            yield _with(node, attr=name)


def _with(node: ast.AST, **fields: object) -> ast.AST:
    changed = copy.copy(node)
    for name, value in fields.items():
        setattr(changed, name, value)
    return changed
