"""A step as plain Python runs it fastest: its stages one after the other, each without what it does twice or need not do.

Every number is the result of the same operations in the same order as in the loop over the stages, so no bit changes:

- a variable that is read once stands where it is read,
- an ``if`` that a branch of the one before it has decided stands inside its branches,
- what is written twice is computed once, and ``abs(x)`` is ``x if x > 0.0 else 0.0 - x`` (zeros of either sign give 0.0),
- ``sum = -0.0`` and ``sum + weight * rate`` of every stage are one expression; no weight of 1.0 is written, and no stage after the last.

Weights and reaches are those of the module's own table ``stages``, so that another method in the place of RK4 stays what it is.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator, Mapping

from lathesim.engine.fusing.step_text import is_safe, without_unread
from lathesim.engine.fusing.text_tree import copied, nodes, read_names, stored_names, target_of

Table = list[tuple[ast.expr, ast.expr]]
"""The weight of each stage in the sum, and the reach of the next."""
_LONGEST_STAGE = 200
"""Statements of a stage that is written four times; four times a longer one takes longer to write than a short run gains."""


def stage_table(block: ast.FunctionDef) -> Table:
    """Return the table of stages that stands in ``run_block``, empty where there is none."""
    for statement in block.body:
        if target_of(statement) == "stages" and isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Tuple):
            pairs = [pair.elts for pair in statement.value.elts if isinstance(pair, ast.Tuple)]
            return [(weight, reach) for weight, reach in pairs]
    return []


def plain_step(loop: ast.stmt, table: Table) -> None:
    """Rewrite the loop over the steps of a sample where it is one, its stages one after the other where they are short enough."""
    if not isinstance(loop, ast.For) or ast.unparse(loop.target) != "substep":
        return
    place = next(place for place, statement in enumerate(loop.body) if isinstance(statement, ast.For))
    stages = loop.body[place]
    assert isinstance(stages, ast.For)
    step = _Step(loop.body[:place], stages.body, loop.body[place + 1 :])
    stages.body = [*step.laws, *step.sums, *step.moves]
    if table and sum(isinstance(node, ast.stmt) for node in nodes(*stages.body)) <= _LONGEST_STAGE:
        loop.body = step.unrolled(table) or loop.body


class _Step:
    """The parts of a step: what is ``before`` the stages, the ``laws`` of a stage, its ``sums`` and ``moves``, and what comes ``after``."""

    def __init__(self, before: list[ast.stmt], stage: list[ast.stmt], after: list[ast.stmt]) -> None:
        self.before, self.after = before, after
        self.sums = [statement for statement in stage if target_of(statement).endswith("__sum")]
        self.moves = [statement for statement in stage if "reach" in read_names(statement)]
        self.laws = [statement for statement in stage if statement not in self.sums and statement not in self.moves]
        self.moved = {target_of(statement) for statement in self.moves}
        self._put_where_read()
        self.laws = _threaded(self.laws)
        self._drop_unread()
        self._compute_once()
        self.laws = [_Magnitudes(self.moved).visit(statement) for statement in self.laws]

    def _put_where_read(self) -> None:
        """Put a variable that is read once in the place where it is read."""
        reads = Counter(read_names(*self.laws, *self.sums, *self.moves))
        for statement in list(self.laws):
            place = self.laws.index(statement)
            reader = _only_reader(statement, self.laws[place + 1 :], reads)
            if reader is not None and isinstance(statement, ast.Assign):
                names = {target_of(statement): statement.value}
                if isinstance(reader, ast.If):
                    reader.test = copied(reader.test, names)
                elif isinstance(reader, ast.Assign):
                    reader.value = copied(reader.value, names)
                reads[target_of(statement)] -= 1
                del self.laws[place]

    def _drop_unread(self) -> None:
        laws = ast.Module(self.laws, [])
        after = set(read_names(*self.sums, *self.moves))
        while without_unread(laws, {*after, *read_names(laws)}, is_safe):
            pass
        self.laws = laws.body

    def _compute_once(self) -> None:
        """Compute what is written twice once, before the laws; only what a stage computes in any case."""
        changing = set(stored_names(*self.laws))
        found: list[ast.stmt] = []
        while True:
            counts = Counter(ast.unparse(node) for node in nodes(*self.laws) if _is_common(node, changing, self.moved))
            always = (ast.unparse(node) for statement in self.laws for node in _always(statement) if _is_common(node, changing, self.moved))
            twice = [text for text in dict.fromkeys(always) if counts[text] > 1]
            if not twice:
                break
            text, name = max(twice, key=len), f"common_{len(found) + 1}"
            self.laws = [_Replaced(text, name).visit(statement) for statement in self.laws]
            found += ast.parse(f"{name} = {text}").body
        self.laws = [*found, *self.laws]

    def unrolled(self, table: Table) -> list[ast.stmt] | None:
        """Return the step with its stages one after the other, none where a state would change while its old value is still needed."""
        current = {target_of(statement): statement.value for statement in self.before if isinstance(statement, ast.Assign)}
        current = {name: value for name, value in current.items() if name in self.moved and isinstance(value, ast.Name)}
        terms: dict[str, list[str]] = {target_of(statement): [] for statement in self.sums}
        rest = [statement for statement in self.before if target_of(statement) not in {*current, *terms}]
        rates = set(read_names(*self.sums)) - {"weight"} - self.moved - terms.keys()
        for number, (weight, reach) in enumerate(table, 1):
            current |= {rate: ast.Name(f"{rate}_{number}", ast.Load()) for rate in rates}
            rest += [copied(statement, current) for statement in self.laws]
            for statement in self.sums:
                rate = ast.unparse(copied(_summand(statement), current))
                terms[target_of(statement)].append(rate if ast.unparse(weight) == "1.0" else f"{ast.unparse(weight)} * {rate}")
            for statement in self.moves if number < len(table) else ():
                assert isinstance(statement, ast.Assign)
                name = f"{target_of(statement)}_{number + 1}"
                value = copied(statement.value, {**current, "reach": reach})
                rest.append(ast.Assign([ast.Name(name, ast.Store())], value, lineno=0))
                current[target_of(statement)] = ast.Name(name, ast.Load())
        return self._with_sums(rest, terms)

    def _with_sums(self, rest: list[ast.stmt], terms: Mapping[str, list[str]]) -> list[ast.stmt] | None:
        sums = {name: ast.parse(" + ".join(some), mode="eval").body for name, some in terms.items()}
        after = [copied(statement, sums) for statement in self.after]
        states = {target_of(statement) for statement in after}
        after.sort(key=lambda statement: not (states - {target_of(statement)}) & set(read_names(statement)))
        for place, statement in enumerate(after):
            if target_of(statement) in read_names(*after[place + 1 :]):
                return None
        return [*rest, *after]


def _summand(statement: ast.stmt) -> ast.expr:
    """Return the rate of ``sum = sum + weight * rate``."""
    match statement:
        case ast.Assign(value=ast.BinOp(right=ast.BinOp(right=rate))):
            return rate
    raise AssertionError(ast.unparse(statement))


def _always(node: ast.AST) -> Iterator[ast.AST]:
    """Return the expressions of a statement that are computed in any case."""
    match node:
        case ast.Assign(value=value):
            yield from _always(value)
        case ast.If(test=test) | ast.IfExp(test=test):
            yield from _always(test)
        case ast.BoolOp(values=[value, *_]):
            yield from _always(value)
        case ast.BinOp() | ast.UnaryOp() | ast.Call() | ast.Tuple() | ast.Name():
            yield node
            for item in ast.iter_child_nodes(node):
                yield from _always(item)
        case ast.Compare(left=left, comparators=[right, *_]):
            yield from _always(left)
            yield from _always(right)


def _is_common(node: ast.AST, changing: set[str], moved: set[str]) -> bool:
    """Return whether an expression is a sum or product that moves with the states, and is the same wherever a stage has it."""
    if not isinstance(node, ast.BinOp) or not is_safe(node):
        return False
    names = set(read_names(node))
    return not names & changing and bool(names & moved)


def _only_reader(statement: ast.stmt, following: list[ast.stmt], reads: Mapping[str, int]) -> ast.stmt | None:
    """Return the statement that alone reads what this one assigns, where its value would be the same there."""
    name = target_of(statement)
    if not name or not isinstance(statement, ast.Assign) or isinstance(statement.value, (ast.Name, ast.Constant)):
        return None
    needed = set(read_names(statement.value))
    for later in following:
        here = read_names(later).count(name)
        if here:
            head = later.test if isinstance(later, ast.If) else later.value if isinstance(later, ast.Assign) else None
            last = reads[name] == 1 or target_of(later) == name
            if head is None or here > 1 or not last or name not in read_names(head):
                return None
            always = any(isinstance(node, ast.Name) and node.id == name for node in _always(head))
            return later if always or is_safe(statement.value) else None
        if {name, *needed} & set(stored_names(later)):
            return None
    return None


def _threaded(statements: list[ast.stmt]) -> list[ast.stmt]:
    """Put an ``if`` inside the branches of the one before it, where what one of them sets decides it."""
    done: list[ast.stmt] = []
    for statement in statements:
        before = done[-1] if done else None
        if isinstance(statement, ast.If) and isinstance(before, ast.If):
            (body, first), (other, second) = _continued(before.body, statement), _continued(before.orelse, statement)
            if first or second:
                before.body, before.orelse = body or [ast.Pass()], other
                continue
        done.append(statement)
    return done


def _continued(branch: list[ast.stmt], following: ast.If) -> tuple[list[ast.stmt], bool]:
    """Return a branch with the ``if`` that follows it; and say whether the branch decides it."""
    known: dict[str, float] = {}
    for statement in branch:
        known = {name: value for name, value in known.items() if name not in stored_names(statement)}
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Constant(value=float(value))):
                known[name] = value
    test = _decided(following.test, known)
    following = copied(following)
    if isinstance(test, bool):
        return [*branch, *(following.body if test else following.orelse)], True
    following.test = test
    return [*branch, following], False


def _decided(test: ast.expr, known: Mapping[str, float]) -> ast.expr | bool:
    """Return what is left of a test where some variables are known numbers."""
    match test:
        case ast.Compare(left=ast.Name(id=name), ops=[how], comparators=[ast.Constant(value=float(right))]) if name in known:
            left = known[name]
            outcomes: dict[type[ast.cmpop], bool] = {
                ast.Lt: left < right, ast.LtE: left <= right, ast.Gt: left > right, ast.GtE: left >= right,
            }  # fmt: skip
            return outcomes.get(type(how), test)
        case ast.BoolOp(op=ast.Or(), values=values):
            rest = [found for value in values if (found := _decided(value, known)) is not False]
            if rest and rest[0] is True:
                return True
            kept = [ast.Constant(item) if isinstance(item, bool) else item for item in rest]
            return False if not kept else kept[0] if len(kept) == 1 else ast.BoolOp(ast.Or(), kept)
    return test


class _Replaced(ast.NodeTransformer):
    """Puts a variable in the place of an expression."""

    def __init__(self, text: str, name: str) -> None:
        self.text = text
        self.name = name

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        return ast.Name(self.name, ast.Load()) if ast.unparse(node) == self.text else self.generic_visit(node)


class _Magnitudes(ast.NodeTransformer):
    """Writes the magnitude of a state as a choice: a call costs twice as much."""

    def __init__(self, states: set[str]) -> None:
        self.states = states

    def visit_Call(self, node: ast.Call) -> ast.AST:
        match node:
            case ast.Call(func=ast.Name(id="abs"), args=[ast.Name(id=name)]) if name in self.states:
                return ast.parse(f"{name} if {name} > 0.0 else 0.0 - {name}", mode="eval").body
        return self.generic_visit(node)
