"""The text of a fused machine written for many runs at once: every variable is a row of lanes, and each lane is one run.

One run waits for its own chain of divisions; sixteen runs side by side let the processor compute vectors. The operations on the numbers of
a lane and their order are those of one run, so its bits are the same. What no lane has of its own, such as a recorded signal or what only
parameters that are alike make, is computed once, and before a loop over time where it is the same each time. What
:mod:`lathesim.engine.lane_flat` refuses runs lane by lane, as do functions without vectors. Parts that idle in every lane are left
out.

``run_block`` has the arguments of the fused module with other meanings: ``parameters`` is the workspace, row after row; ``states`` takes
the samples that each lane was advanced until it finished; ``discrete`` holds the numbers between the records of two lanes; ``memories``,
``tables`` and ``noise`` hold each array once a lane.
"""

from __future__ import annotations

import ast
import copy
import functools
import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lathesim.cache_folder import keep_sealed, kept_sealed
from lathesim.component import ON
from lathesim.engine.fuse import FusedModule, Writer, flat_name, fuse
from lathesim.engine.lane_flat import Flattener, calls, functions_of
from lathesim.engine.law_text import NotInPlaceError, Piece, Renamed, read_names, stored_names
from lathesim.engine.wiring import Plan

LANES = 16
"""Runs side by side: two vectors of AVX-512; with fewer the compiler unrolls the loop instead of making vectors."""

_STAGES = "for weight, reach in stages:"
_SHORT = 32
"""Statements up to which the stages of a step stand in the text one after the other; with more there are too few registers."""
_HEAD = """import math

def choose(test, one, other):
    return one if test else other
"""
_RUN = "def run_block(first, count, period, step, steps, parameters, states, discrete, memories, tables, noise, record):"


@dataclass(frozen=True)
class LaneModule:
    """The text for lanes. ``rows`` is the place of each variable in the workspace."""

    fused: FusedModule
    rows: Mapping[str, int]


@dataclass
class _Loop:
    """Statements of a loop over the lanes: of ``vectors``, of ``calls`` of functions, or ``alone`` as it stood; ``once`` is no loop."""

    statements: list[ast.stmt]
    kind: str = ""
    read: set[str] = field(init=False)
    stored: set[str] = field(init=False)

    def __post_init__(self) -> None:
        self.read, self.stored = set(read_names(*self.statements)), set(stored_names(*self.statements))

    def take(self, other: _Loop) -> None:
        """Take the statements of another in."""
        self.statements += other.statements
        self.read |= other.read
        self.stored |= other.stored


@dataclass
class _Block:
    """Statements under a line that is the same for all lanes."""

    head: str
    body: list[_Op]

    @property
    def read(self) -> set[str]:
        """What the line reads."""
        return set(read_names(ast.parse(f"{self.head} pass")))


@dataclass
class _Finish:
    name: str


@dataclass
class _Keep:
    begin: str
    names: list[str]


_Op = _Loop | _Block | _Finish | _Keep


_Key = tuple[str, frozenset[str], frozenset[tuple[str, bool]]]
_WRITTEN: dict[_Key, LaneModule | None] = {}
"""Modules by the text of their machine, what varies and what idles; none where the cache has none."""


def lane_module(plan: Plan, varied: frozenset[str], idle: Mapping[str, bool]) -> LaneModule:
    """Return the module of a plan for lanes; one that was written before is taken from the cache.

    ``varied`` are the parameters, states, tables and noises that differ between the lanes, ``idle`` says of parts that idle in all lanes or
    in none which it is. Raises :class:`NotInPlaceError` where nothing would be in vectors.
    """
    return known_module(plan, varied, idle) or _written(plan, varied, idle)


def known_module(plan: Plan, varied: frozenset[str], idle: Mapping[str, bool]) -> LaneModule | None:
    """Return the module of a plan for lanes if it was written before."""
    key = fuse(plan).digest, varied, frozenset(idle.items())
    if key not in _WRITTEN:
        kept = kept_sealed(_file_name(key))
        _WRITTEN[key] = None if kept is None else _restored(json.loads(kept))
    return _WRITTEN[key]


def _restored(kept: Mapping[str, Any]) -> LaneModule:
    pieces = tuple(Piece(name, text, tuple(uses), digest) for name, text, uses, digest in kept["pieces"])
    return LaneModule(_fused(kept["source"], pieces), kept["rows"])


def _written(plan: Plan, varied: frozenset[str], idle: Mapping[str, bool]) -> LaneModule:
    key = fuse(plan).digest, varied, frozenset(idle.items())
    made = _WRITTEN[key] = _LaneWriter(plan, varied, idle).module()
    pieces = [(piece.name, piece.text, piece.uses, piece.digest) for piece in made.fused.pieces]
    keep_sealed(_file_name(key), json.dumps({"source": made.fused.source, "pieces": pieces, "rows": dict(made.rows)}).encode())
    return made


def _file_name(key: _Key) -> str:
    """Return the file of a module in the cache, named by all that it is made of."""
    digest, varied, idle = key
    return f"lanes_{hashlib.sha256(repr((_writer(), digest, sorted(varied), sorted(idle))).encode()).hexdigest()[:32]}.json"


@functools.cache
def _writer() -> str:
    """Return the digest of the files that write modules."""
    return hashlib.sha256(b"".join(file.read_bytes() for file in sorted(Path(__file__).parent.glob("*.py")))).hexdigest()


def _fused(source: str, pieces: tuple[Piece, ...]) -> FusedModule:
    return FusedModule(source, pieces, hashlib.sha256(source.encode()).hexdigest()[:32])


class _LaneWriter:
    def __init__(self, plan: Plan, varied: frozenset[str], idle: Mapping[str, bool]) -> None:
        writer = Writer(plan, idle=idle)
        lines = writer.sample()
        self.laws = writer.laws
        self.kept = [flat_name(name) for name in (*plan.parameters, *plan.states, *plan.discrete)]
        self.rows = {name: place for place, name in enumerate(self.kept)}
        mixed = {f"{part.name}__idle" for part in plan.parts.values() if part.component.idle()[0] and part.name not in idle}
        self.arrays = {flat_name(name): f"vector(memories, {LANES * place}{{}})" for name, place in plan.arrays.memories.items()}
        self.arrays |= {flat_name(name): f"matrix(tables, {LANES * place}{{}})" for name, place in plan.arrays.tables.items()}
        self.arrays |= {f"{flat_name(name)}__noise": f"vector(noise, {LANES * place}{{}})" for name, place in plan.arrays.noises.items()}
        drawn = [f"{flat_name(name)}__noise" for name in varied]
        self.varying = {*map(flat_name, varied), *drawn, *map(flat_name, plan.arrays.memories), *mixed}
        self.setup = [f"{name} = {text.format('')}" for name, text in self.arrays.items() if name not in self.varying]
        self.setup += [f"{part.name}__sample_period = period * {part.every}.0" for part in plan.parts.values() if part.every > 1]
        self.stages = plan.tableau.stages
        self.setup += plan.tableau.lines()
        self.setup.append(f"{', '.join(f'(weight_{place}, reach_{place})' for place, _ in enumerate(self.stages))}, = stages")
        self.flattener = Flattener(functions_of("\n".join(self.laws.blocks)), [*self.kept, *mixed], mixed)
        ops: list[_Op] = [_Block("for sample in range(count):", self._ops(ast.parse("\n".join(lines)).body))]
        self._spread([op for op in _every(ops) if isinstance(op, _Loop)])
        self.ops = _merged(self._settled(ops))

    def _ops(self, body: Iterable[ast.stmt]) -> list[_Op]:
        return [op for statement in body for op in self._op(statement)]

    def _op(self, statement: ast.stmt) -> list[_Op]:
        match statement:
            case ast.Assign(targets=[ast.Name(id="done")]):
                return []
            case ast.If(test=ast.Compare(left=ast.Name(id=name))) if any(isinstance(item, ast.Break) for item in statement.body):
                return [_Finish(name)]
            case ast.For(target=target, body=body):
                return [_Block(f"for {ast.unparse(target).strip('()')} in {ast.unparse(statement.iter)}:", self._ops(body))]
            case ast.If(test=test, body=body) if {"first", "sample"} == set(read_names(test)):
                return [_Block(f"if {ast.unparse(test)}:", self._ops(body))]
            case ast.Expr(value=ast.Call(func=ast.Name(id="keep"), args=[_, begin, ast.Tuple(elts=values)])):
                return [_Keep(ast.unparse(begin), [ast.unparse(value) for value in values])]
        try:
            return [_Loop([ast.Assign([ast.Name(name, ast.Store())], value, lineno=0)]) for name, value in self.flattener.flat(statement)]
        except NotInPlaceError:
            self.flattener.known |= set(stored_names(statement))
            return [_Loop([statement], "alone")]

    def _spread(self, loops: list[_Loop]) -> None:
        """Find the variables that differ between lanes because of what they are made of, and with them the kind of each loop."""
        while new := [op for op in loops if not op.stored <= self.varying and not self.varying.isdisjoint(op.read)]:
            self.varying |= {name for op in new for name in op.stored}
        for op in loops:
            if self.varying.isdisjoint(op.stored):
                op.kind = "once"
            else:
                op.kind = op.kind or ("calls" if calls(op.statements[0]) else "vectors")

    def _settled(self, ops: Iterable[_Op]) -> list[_Op]:
        """Return statements with what a loop over time computes alike each time before it."""
        made: list[_Op] = []
        for op in ops:
            if isinstance(op, _Block):
                held, body = self._held(self._settled(op.body), op.head) if op.head.startswith("for") else ([], self._settled(op.body))
                is_short = len(body) <= _SHORT and all(isinstance(item, _Loop) and item.kind == "vectors" for item in body)
                made += [*held, *(self._unrolled(body) if is_short and op.head == _STAGES else [_Block(op.head, _merged(body))])]
            else:
                made.append(op)
        return made

    def _unrolled(self, body: list[_Op]) -> Iterator[_Op]:
        """Yield the stages of a step one after the other, to stand in one loop over the lanes whose numbers stay in registers."""
        for place, _ in enumerate(self.stages):
            names = Renamed({"weight": f"weight_{place}", "reach": f"reach_{place}"})
            for op in body:
                assert isinstance(op, _Loop)
                yield _Loop([names.visit(copy.deepcopy(statement)) for statement in op.statements], op.kind)

    def _held(self, ops: list[_Op], head: str) -> tuple[list[_Op], list[_Op]]:
        changing = Counter(stored_names(ast.parse(f"{head} pass")))
        changing.update(name for op in _every(ops) if isinstance(op, _Loop) for name in op.stored)
        held: list[_Op] = []
        rest: list[_Op] = []
        read: set[str] = set()
        for op in ops:
            if (
                isinstance(op, _Loop)
                and op.kind != "alone"
                and not any(changing[name] for name in op.read)
                and all(changing[name] == 1 and name not in self.rows and name not in read for name in op.stored)
            ):
                held.append(op)
                changing -= Counter(op.stored)
            else:
                rest.append(op)
                read |= _read([op])
        return held, rest

    # ---- text -----------------------------------------------------------------------------------------------------------------

    def module(self) -> LaneModule:
        """Write the module."""
        while self._drop(_read(self.ops)):
            pass
        loops = [op for op in _every(self.ops) if isinstance(op, _Loop) and op.kind != "once"]
        if not any(op.kind == "vectors" and op.statements for op in loops):
            raise NotInPlaceError  # nothing of it depends on what differs between the runs
        self.touched = Counter(name for op in loops for name in {*read_names(*op.statements), *stored_names(*op.statements)})
        self.across = {name for op in loops for name in self._read_first(op)}
        self.across |= {name for op in _every(self.ops) if isinstance(op, (_Keep, _Finish)) for name in _read([op])}
        body = self._lines(self.ops)
        begin = [f"{name} = parameters[{LANES * self.rows[name]}]" for name in self.kept if name not in self.varying]
        inside = [*self.setup, *begin, "between = int(discrete[0])", "left = True", *body, "return count"]
        source = "\n".join([_HEAD, *self.laws.blocks, "", _RUN, *_indented(inside), ""])
        used = self.laws.with_theirs(_read(self.ops))
        pieces = tuple(piece for piece in self.laws.pieces.values() if piece.name in used)
        return LaneModule(_fused(source, pieces), self.rows)

    def _drop(self, read: set[str]) -> bool:
        """Take away the assignments in loops that nobody reads; say whether there were any."""
        found = False
        for op in _every(self.ops):
            if isinstance(op, _Loop) and op.kind != "alone":
                left = [item for item in op.statements if not read.isdisjoint(stored_names(item))]
                if len(left) < len(op.statements):
                    found, op.statements, op.read = True, left, set(read_names(*left))
        return found

    def _place(self, name: str) -> str:
        return f"parameters[{LANES * self.rows.setdefault(name, len(self.rows))} + lane]"

    def _lines(self, ops: list[_Op]) -> list[str]:
        lines: list[str] = []
        for op in ops:
            match op:
                case _Block(head, body):
                    lines += [head, *_indented(self._lines(body) or ["pass"])]
                case _Loop(statements):
                    lines += self._loop(op) if statements else []
                case _Finish(name):
                    lines += ["left = False", f"for lane in range({LANES}):", "    if states[lane] == 0.0:"]
                    lines += [f"        if {self._read(name)} > {ON}:", "            states[lane] = sample + 1.0"]
                    lines += ["        else:", "            left = True", "if not left:", "    break"]
                case _Keep(begin, names):
                    lines.append(f"for lane in range({LANES}):")
                    lines += [f"    record[lane * between + {begin} + {place}] = {self._read(name)}" for place, name in enumerate(names)]
        return lines

    def _read(self, name: str) -> str:
        return self._place(name) if name in self.varying else name

    def _loop(self, loop: _Loop) -> list[str]:
        text = [line for item in loop.statements for line in ast.unparse(item).splitlines()]
        if loop.kind == "once":
            return text
        bools = self.flattener.bools
        lines = []
        for name in self._read_first(loop):
            value = self.arrays[name].format(" + lane") if name in self.arrays else self._place(name)
            lines.append(f"{name} = {value}{f' > {ON}' if name in bools else ''}")
        lines += text
        for name in dict.fromkeys(stored_names(*loop.statements)):
            if name in self.across:
                lines.append(f"{self._place(name)} = {f'choose({name}, 1.0, 0.0)' if name in bools else name}")
        return [f"for lane in range({LANES}):", *_indented(lines)]

    def _read_first(self, loop: _Loop) -> list[str]:
        """Return the rows that a loop reads before it has assigned them in any case."""
        found: dict[str, None] = {}
        stored: set[str] = set()
        for statement in loop.statements:
            own = set(stored_names(statement))
            branches = isinstance(statement, (ast.If, ast.For))
            local = {name for name in own if self.touched[name] == 1 and name not in self.rows} if branches else set()
            for name in [*read_names(statement), *(own if branches else ())]:
                if name in self.varying and name not in stored and name not in local:
                    found[name] = None
            stored |= own
        return list(found)


def _merged(ops: Iterable[_Op]) -> list[_Op]:
    """Return loops put together: each goes to the earliest one of its kind that may take it in, past what has nothing to do with it."""
    made: list[_Op] = []
    for new in ops:
        place, found = len(made), None
        while isinstance(new, _Loop) and place and isinstance(op := made[place - 1], _Loop):
            found = op if op.kind == new.kind != "alone" else found
            if op.kind == new.kind == "alone" or not (op.stored.isdisjoint(new.read | new.stored) and op.read.isdisjoint(new.stored)):
                break
            place -= 1
        if found is not None and isinstance(new, _Loop):
            found.take(new)
        else:
            made.insert(place if isinstance(new, _Loop) and new.kind == "once" else len(made), new)
    return made


def _every(ops: Iterable[_Op]) -> Iterator[_Op]:
    for op in ops:
        yield op
        if isinstance(op, _Block):
            yield from _every(op.body)


def _read(ops: Iterable[_Op]) -> set[str]:
    """Return the variables that anything reads."""
    read: set[str] = set()
    for op in _every(ops):
        match op:
            case _Loop():
                read |= op.read | (op.stored if op.kind == "alone" else set())
            case _Keep(begin, names):
                read |= {*names, *read_names(ast.parse(begin))}
            case _Finish(name):
                read.add(name)
            case _Block():
                read |= op.read
    return read


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"    {line}" for line in lines]
