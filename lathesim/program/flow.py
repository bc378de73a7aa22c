"""Which block comes next: one after the other, subprograms, loops and branches; and the variables that decide it.

Source: LinuxCNC 2.9 manual, chapter O Codes; Fanuc 0i operator's manual, subprograms (M98, M99) and custom macro (G65, IF, WHILE, GOTO);
Haas lathe operator's manual (M97).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

from lathesim.errors import Fault, nearest
from lathesim.program.dialects import Dialect
from lathesim.program.expressions import Assignment, Expression, Value, Variables
from lathesim.program.meanings import Meaning
from lathesim.program.modal import Modal, system_value
from lathesim.program.motions import broken
from lathesim.program.moves import Corner, Event, Made, Move, Moves, PlannedMove
from lathesim.program.statements import Keyword, Statement, Structure, structure
from lathesim.program.vocabulary import Codes, Sorted, check_statement, sort_block
from lathesim.program.words import Block, Blocks, Word

DEEPEST_CALL = 10  # Source: LinuxCNC 2.9, levels of subroutines; Fanuc has 4 to 10
MOST_CALLS = 9999  # repeats of one call. Source: Fanuc 0i-T operator's manual, subprogram call
MOST_RUNS = 100_000  # blocks run again by loops and calls, assumed: far more than any part needs, and done in seconds
_ARGUMENTS = {
    "A": 1, "B": 2, "C": 3, "D": 7, "E": 8, "F": 9, "H": 11, "I": 4, "J": 5, "K": 6, "M": 13, "Q": 17, "R": 18, "S": 19, "T": 20, "U": 21,
    "V": 22, "W": 23, "X": 24, "Y": 25, "Z": 26,
}  # fmt: skip
"""Variables that the letters of a macro call fill. Source: Fanuc 0i operator's manual, custom macro, argument assignment I."""
_RETURN = -1
"""The next place where a subprogram returns."""
_CODE_DIGITS = 4
"""Decimals of a computed number of a code: rounding errors are taken off."""

Step = Callable[[Sorted, Modal, Dialect], Made]
"""One step of a block: it changes what is in force and returns what it makes."""


@dataclass(frozen=True)
class Walked:
    """A contour as the program would run it: its moves and its events."""

    moves: list[Move]
    events: list[Event]


class Flow:
    """Runs the blocks of a program in the order that it asks for, each by the steps that ``steps_of`` gives for it.

    ``position`` is the place of the present block, ``passed`` are places of contours that are not run again, ``depth`` counts the calls
    under way and ``runs`` the blocks run; while ``walking``, a contour is run for a cycle. With ``strict`` codes that do nothing here are
    refused.
    """

    def __init__(
        self, blocks: Blocks, dialect: Dialect, modal: Modal, steps_of: Callable[[Sorted], tuple[Step, ...]], strict: bool
    ) -> None:
        self.blocks, self.dialect, self.modal, self.steps_of, self.strict = blocks, dialect, modal, steps_of, strict
        self.moves, self.events = Moves(), list[Event]()
        self.warnings, self.assumed = list(blocks.warnings), dict[str, str]()
        self.contours: dict[int, tuple[Move, ...]] = {}
        self.known: dict[tuple[Word, ...], Codes] = {}
        self.variables = Variables(
            lambda key: system_value(key, self.modal, dialect), locals_to=dialect.program.locals_up_to, empty=dialect.program.unset_is_empty
        )
        self.position = self.depth = self.runs = 0
        self.passed: set[int] = set()
        self.moved = self.walking = self.ended = False
        self.go_to = ""
        self.corner: Corner | None = None
        self._loops: dict[int, int] = {}
        self._numbers: dict[int, dict[float, list[int]]] = {}
        self._structures: dict[int, Structure] = {}

    def run_blocks(self, begin: int = 0, end: int | None = None) -> None:
        """Run the blocks from ``begin`` to before ``end``, up to the end of the program or the return from a subprogram."""
        blocks = self.blocks.blocks
        end = len(blocks) if end is None else end
        position = begin
        allowed = len(blocks) + MOST_RUNS
        while begin <= position < end and not self.ended:
            if position in self.passed:
                position += 1
                continue
            block, self.position = blocks[position], position
            self.runs += 1
            try:
                if self.runs > allowed:
                    fact = f"Loops and subprograms run more than {MOST_RUNS} blocks."
                    raise Fault(fact, "A loop may have no end. Check its condition, or repeat less often.")
                position = self._run(block) if block.statement is None else self._statement(block, block.statement)
            except Fault as fault:
                raise fault.at(self.blocks.name, block.line) from None

    def _run(self, block: Block) -> int:
        """Run a block without a statement and return the place of the next one."""
        if block.fault is not None:
            raise block.fault
        own = sort_block(self._computed(block) if block.assignments or block.computed else block, self)
        if own.codes or own.words or own.comments or own.builders:
            for step in self.steps_of(own):
                for made in step(own, self.modal, self.dialect):
                    self._append(made)
            if not self.moved:
                self.modal.said.update(own.groups)
                self.moved = bool(self.moves)
        if Meaning.SUBPROGRAM_END in own.codes and (self.depth > 0 or self.ended):
            return _RETURN
        if self.go_to:
            place, self.go_to = self._numbered_place(self.go_to), ""
            return place
        return self.position + 1

    def _append(self, made: PlannedMove | Event) -> None:
        if isinstance(made, Event):
            self.events.append(replace(made, before_move=len(self.moves)))
            return
        self.moves.add(made)
        corner, self.corner = self.corner, made.corner
        if corner is not None and len(self.moves) > 1:
            try:
                self.moves.replace_last(2, broken(self.moves[-2], self.moves[-1], corner))
            except Fault as fault:
                raise fault.at(self.blocks.name, corner.line) from None

    def numbered(self, number: float) -> list[int]:
        """Return the places of the blocks of the current program with this N number."""
        found = self._numbers.get(id(self.blocks.blocks))
        if found is None:
            found = self._numbers[id(self.blocks.blocks)] = {}
            for place, block in enumerate(self.blocks.blocks):
                if block.number:
                    found.setdefault(float(block.number), []).append(place)
        return found.get(number, [])

    def _numbered_place(self, number: str) -> int:
        """Return the place of the block N ``number``, looked for from here on, else from the beginning."""
        places = self.numbered(float(number))
        if places:
            return next((place for place in places if place > self.position), places[0])
        fact = f"The program goes to N{number}, and there is no such block."
        raise Fault(fact, "Correct the number, or put it in front of the block that is meant.")

    @contextmanager
    def _aside(self, **others: object) -> Iterator[None]:
        """Run what stands inside with other values, and take the old ones back."""
        kept = {name: getattr(self, name) for name in ("position", *others)}
        vars(self).update(others)
        yield
        vars(self).update(kept)

    # ---- values and statements ---------------------------------------------------------------------------------------------------

    def _computed(self, block: Block) -> Block:
        """Return the block with the numbers of its expressions; its assignments are carried out."""
        if not self.dialect.program.variables:
            check_statement(block, self.dialect)
        values = [assignment.value.evaluate(self.variables) for assignment in block.assignments]
        words = []
        for word in block.words:
            value = word.value if word.expression is None else word.expression.evaluate(self.variables)
            if word.expression is not None and value is not None:
                value = round(value, _CODE_DIGITS) if word.letter in "GMT" else value
            if value is not None:
                words.append(word._replace(value=value))
        for assignment, value in zip(block.assignments, values, strict=True):
            self._assign(assignment, value, block)
        return block._replace(words=tuple(words))

    def _assign(self, assignment: Assignment, value: Value, block: Block) -> None:
        alarm = self.dialect.program.alarm_variable
        if assignment.number is not None and alarm is not None and assignment.number.evaluate(self.variables) == alarm:
            said = f": {block.comments[0]}" if block.comments else ""
            raise Fault(f"The program stops itself with an alarm{said}.", "Look for the condition in front of it.")
        assignment.carry_out(self.variables, value)

    def _value(self, expression: Expression) -> float:
        return expression.evaluate(self.variables) or 0.0

    def structure(self) -> Structure:
        """Return what belongs together among the statements of the present program."""
        if not self.blocks.branches:
            return Structure()
        blocks = self.blocks.blocks
        if id(blocks) not in self._structures:
            statements = [(place, block.statement) for place, block in enumerate(blocks) if block.statement is not None]
            self._structures[id(blocks)] = structure(statements, lambda place: blocks[place].line)
        return self._structures[id(blocks)]

    def _statement(self, block: Block, statement: Statement) -> int:
        """Carry out a statement and return the place of the next block."""
        kind, here, found = statement.kind, self.position, self.structure()
        partner = found.partner.get(here, here)
        if kind in (Keyword.ELSE_IF, Keyword.ELSE):
            return found.partner[partner] + 1
        if kind in (Keyword.RETURN, Keyword.END_SUB):
            self._give_back(statement)
            return _RETURN
        if kind is Keyword.CALL:
            self._call(statement, found)
            return here + 1
        if kind is Keyword.IF:
            return self._branch(statement, here, found)
        if kind in (Keyword.BREAK, Keyword.CONTINUE):
            loop = found.loop_of[here]
            if kind is Keyword.BREAK:
                self._loops.pop(loop, None)
            return found.partner[loop] + (kind is Keyword.BREAK)
        if kind is Keyword.GO_TO:
            holds = statement.condition is None or self._condition(statement)
            return self._numbered_place(f"{self._value(statement.values[0]):g}") if holds else here + 1
        if kind is Keyword.IF_THEN:
            if self._condition(statement):
                self._computed(block._replace(statement=None, assignments=statement.assignments))
            return here + 1
        if kind in (Keyword.END_WHILE, Keyword.END_REPEAT, Keyword.LOOP_END):
            return partner
        if kind in (Keyword.END_IF, Keyword.DO):
            return here + 1
        if kind is Keyword.WHILE and partner < here:  # behind DO
            return partner + 1 if self._condition(statement) else here + 1
        return here + 1 if self._enters(statement, here) else partner + 1

    def _enters(self, statement: Statement, here: int) -> bool:
        """Return whether a subprogram or loop that begins here is entered; ``_loops`` counts the rounds of REPEAT that are left."""
        if statement.kind is Keyword.REPEAT:
            left = self._loops.pop(here, None)
            left = round(self._value(statement.values[0])) if left is None and statement.values else left or 0
            if left > 0:
                self._loops[here] = left - 1
            return left > 0
        endless = statement.kind is Keyword.LOOP and statement.condition is None
        return statement.kind is not Keyword.SUB and (endless or self._condition(statement))

    def _branch(self, statement: Statement, here: int, found: Structure) -> int:
        if self._condition(statement):
            return here + 1
        for place in found.branches[here]:
            branch = self.blocks.blocks[place]
            try:
                if branch.statement is None or branch.statement.kind is not Keyword.ELSE_IF or self._condition(branch.statement):
                    return place + 1
            except Fault as fault:
                raise fault.at(self.blocks.name, branch.line) from None
        return found.partner[here] + 1

    def _condition(self, statement: Statement) -> bool:
        condition = statement.condition or (statement.values[0] if statement.values else None)
        if condition is None:
            shown = f"O{statement.label} {statement.kind}"
            raise Fault(f"{shown} has no condition.", f"Write it as {shown} [#1 LT 5].")
        return self._value(condition) != 0.0

    # ---- calls and contours ------------------------------------------------------------------------------------------------------

    def _call(self, statement: Statement, found: Structure) -> None:
        """O ... CALL with its arguments in #1, #2 and so on."""
        shown = f"O{statement.label} CALL"
        if statement.label not in found.subs:
            remedy = nearest(statement.label, found.subs) or "Write it in front of the call, from O... SUB to O... ENDSUB."
            raise Fault(f"{shown} calls a subprogram that the file does not have.", remedy)
        self.check_depth(shown)
        arguments = {number: self._value(value) for number, value in enumerate(statement.values, start=1)}
        begin = found.subs[statement.label]
        self.variables.enter(arguments)
        with self._aside(depth=self.depth + 1, _loops={}):
            self.run_blocks(begin + 1, found.partner[begin] + 1)
        self.variables.leave()

    def _give_back(self, statement: Statement) -> None:
        if self.depth == 0:
            raise Fault(f"O{statement.label} {statement.kind} stands outside a subprogram.", "Write M2 to end the program.")
        self.variables.set_name("_VALUE_RETURNED", float(bool(statement.values)))
        if statement.values:
            self.variables.set_name("_VALUE", self._value(statement.values[0]))

    def check_depth(self, code: str) -> None:
        """Refuse a call inside too many others."""
        if self.depth >= DEEPEST_CALL:
            raise Fault(f"{code} calls more than {DEEPEST_CALL} programs deep.", "A program may not call itself.")

    def call(self, blocks: tuple[Block, ...], times: int, arguments: Mapping[int, float] | None) -> None:
        """Run the blocks of a subprogram so many times; with ``arguments`` it has variables of its own."""
        if arguments is not None:
            self.variables.enter(arguments)
        for _ in range(times):
            if not self.ended:
                with self._aside(blocks=replace(self.blocks, blocks=blocks), passed=set(), depth=self.depth + 1):
                    self.run_blocks()
        if arguments is not None:
            self.variables.leave()

    def walk(self, first: int, last: int, modal: Modal) -> Walked:
        """Return the contour from the ``first`` block to the ``last`` as the program would run it, with ``modal`` in force."""
        if self.walking:
            raise Fault("A cycle stands in the contour of a cycle.", "Write the contour with G0 to G3 only.")
        modal.modes.motion, self.corner = None, None
        with self._aside(modal=modal, moves=Moves(), events=[], passed=set(), walking=True):
            self.run_blocks(first, last + 1)
            self.contours.setdefault(first, tuple(self.moves))
            walked = Walked(list(self.moves), self.events)
        if self.corner is not None:
            raise Fault(f"{self.corner.text} needs a straight feed before and behind it.", "Write arcs with G2 and G3.", self.corner.line)
        return walked


def subprogram(block: Sorted, modal: Modal, dialect: Dialect) -> Made:
    """M98 P n L k calls the program O n k times; P 30012 calls O0012 three times. M97 calls from N n, G65 with variables of its own."""
    flow = block.flow
    ended = _returned(block) if block.has(Meaning.SUBPROGRAM_END) else ()
    meaning = next((one for one in (Meaning.SUBPROGRAM, Meaning.LOCAL_SUBPROGRAM, Meaning.MACRO_CALL) if block.has(one)), None)
    if meaning is None:
        return ended
    code, p, repeats = block.codes[meaning].text, block.take("P"), block.take("L")
    if p is None or p.value < 0.0 or p.value != int(p.value):
        raise Fault(f"{code} needs the number of a program.", f"Write it as {code} P0012.")
    number, times = int(p.value), 1 if repeats is None else int(repeats.value)
    is_local = meaning is Meaning.LOCAL_SUBPROGRAM
    known, letter = (flow.blocks.locals, "N") if is_local else (flow.blocks.subprograms, "O")
    if number not in known and number > MOST_CALLS and repeats is None:
        times, number = divmod(number, MOST_CALLS + 1)
    if number not in known:
        names = ", ".join(f"{letter}{key:04d}" for key in known)
        remedy = f"It has {names}." if names else f"Write it behind the M30 of the main program, from its {letter} number to M99."
        raise Fault(f"{code} calls the program {letter}{number:04d}, which the file does not have.", remedy)
    flow.check_depth(code)
    if not 0 <= times <= MOST_CALLS:
        raise Fault(f"{code} repeats {times} times.", f"Repeat at most {MOST_CALLS} times.")
    arguments = None
    if meaning is Meaning.MACRO_CALL:
        arguments = {_ARGUMENTS[letter]: word.value for letter, word in block.takes([*_ARGUMENTS.keys() - block.used]).items()}
    flow.call(known[number], times, arguments)
    return ended


def _returned(block: Sorted) -> Made:
    """M99, or M99 P n, which goes to N n of the program that called; of the main program itself where none did."""
    flow, code, p = block.flow, block.codes[Meaning.SUBPROGRAM_END].text, block.take("P")
    if p is not None:
        flow.go_to = f"{p.value:g}"
    elif flow.depth == 0:
        block.warn(f"{code} in the main program begins it again on a machine; here it ends the program.")
        flow.ended = True
        return [Event("spindle", block.line), Event("program_end", block.line)]
    return ()
