"""Which block comes next: one after the other, subprograms, loops and branches; and the variables that decide it.

Source: LinuxCNC 2.9 manual, chapter O Codes; Fanuc 0i operator's manual, subprograms (M98, M99) and custom macro (G65, IF, WHILE, GOTO);
Haas lathe operator's manual (M97).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from lathesim.errors import ProgramError, nearest
from lathesim.program.cycle_blocks import Cycles
from lathesim.program.expressions import Assignment, Expression, ExpressionError, Value, Variables
from lathesim.program.meanings import Meaning
from lathesim.program.modal import system_value
from lathesim.program.statements import FANUC_KINDS, Keyword, Statement, Structure, structure
from lathesim.program.vocabulary import check_statement
from lathesim.program.words import Block

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


class Flow(Cycles):
    """Runs blocks in the order that the program asks for; ``depth`` counts the calls under way, ``runs`` the blocks run."""

    depth = 0
    runs = 0
    ended = False
    go_to = ""

    @property
    def variables(self) -> Variables:
        """The variables of the program, made when the first one is asked for."""
        if self._variables is None:
            self._variables = Variables(
                lambda key: system_value(key, self.modal, self.dialect),
                locals_to=self.dialect.locals_up_to,
                empty=self.dialect.unset_is_empty,
            )
        return self._variables

    _variables: Variables | None = None
    _structures: dict[int, Structure] | None = None
    _loops: dict[int, int] | None = None

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
            if self.runs > allowed:
                raise ProgramError(
                    f"Loops and subprograms run more than {MOST_RUNS} blocks.",
                    place=self.blocks.place(block.line),
                    remedy="A loop may have no end. Check its condition, or repeat less often.",
                )
            if block.statement is not None:
                position = self._statement(block, block.statement)
                continue
            if block.fault is not None:
                raise block.fault
            self.run_block(block)
            if Meaning.SUBPROGRAM_END in self.block.codes and (self.depth > 0 or self.ended):
                return
            if self.go_to:
                position = self._numbered_place(self.go_to)
                self.go_to = ""
                continue
            position += 1

    # ---- values ------------------------------------------------------------------------------------------------------------------

    def computed(self, block: Block) -> Block:
        """Return the block with the numbers of its expressions; its assignments are carried out."""
        if not block.assignments and not block.computed:
            return block
        if not self.dialect.variables:
            check_statement(block, self.blocks, self.dialect)
        try:
            values = [assignment.value.evaluate(self.variables) for assignment in block.assignments]
            words = []
            for word in block.words:
                if word.expression is None:
                    words.append(word)
                    continue
                value = word.expression.evaluate(self.variables)
                if value is not None:
                    words.append(word._replace(value=_code_number(value) if word.letter in "GMT" else value))
            for assignment, value in zip(block.assignments, values, strict=True):
                self._assign(assignment, value, block)
        except ExpressionError as fault:
            raise ProgramError(fault.fact, place=self.blocks.place(block.line), remedy=fault.remedy) from fault
        return block._replace(words=tuple(words))

    def _assign(self, assignment: Assignment, value: Value, block: Block) -> None:
        alarm = self.dialect.alarm_variable
        if assignment.number is not None and alarm is not None and assignment.number.evaluate(self.variables) == alarm:
            said = f": {block.comments[0]}" if block.comments else ""
            raise ExpressionError(f"The program stops itself with an alarm{said}.", "Look for the condition in front of it.")
        assignment.carry_out(self.variables, value)

    def _value(self, expression: Expression, block: Block) -> float:
        try:
            return expression.evaluate(self.variables) or 0.0
        except ExpressionError as fault:
            raise ProgramError(fault.fact, place=self.blocks.place(block.line), remedy=fault.remedy) from fault

    # ---- statements --------------------------------------------------------------------------------------------------------------

    def structure(self) -> Structure:
        """Return what belongs together among the statements of the present program."""
        if not self.blocks.branches:
            return Structure()
        self._structures = {} if self._structures is None else self._structures
        key = id(self.blocks.blocks)
        if key not in self._structures:
            statements = [(place, block.statement) for place, block in enumerate(self.blocks.blocks) if block.statement is not None]
            self._structures[key] = structure(statements, lambda place: self.blocks.place(self.blocks.blocks[place].line))
        return self._structures[key]

    def _statement(self, block: Block, statement: Statement) -> int:
        """Carry out a statement and return the place of the next block."""
        kind, here, found = statement.kind, self.position, self.structure()
        if kind in (Keyword.SUB, Keyword.ELSE_IF, Keyword.ELSE):
            opened = here if kind is Keyword.SUB else found.partner[here]
            return found.partner[opened] + 1
        if kind in (Keyword.RETURN, Keyword.END_SUB):
            self._give_back(statement, block)
            return _RETURN
        if kind in (Keyword.END_IF, Keyword.DO):
            return here + 1
        if kind is Keyword.CALL:
            self._call(statement, block, found)
            return here + 1
        if kind is Keyword.IF:
            return self._branch(block, statement, here, found)
        if kind in FANUC_KINDS:
            return self._macro_statement(block, statement, here, found)
        return self._loop(block, statement, here, found)

    def _branch(self, block: Block, statement: Statement, here: int, found: Structure) -> int:
        if self._condition(statement, block):
            return here + 1
        for place in found.branches[here]:
            branch = self.blocks.blocks[place]
            if branch.statement is None or branch.statement.kind is not Keyword.ELSE_IF or self._condition(branch.statement, branch):
                return place + 1
        return found.partner[here] + 1

    def _condition(self, statement: Statement, block: Block) -> bool:
        condition = statement.condition or (statement.values[0] if statement.values else None)
        if condition is None:
            raise ProgramError(
                f"O{statement.label} {statement.kind} has no condition.",
                place=self.blocks.place(block.line),
                remedy=f"Write it as O{statement.label} {statement.kind} [#1 LT 5].",
            )
        return self._value(condition, block) != 0.0

    def _loop(self, block: Block, statement: Statement, here: int, found: Structure) -> int:
        """WHILE, REPEAT, their ends, BREAK and CONTINUE; ``_loops`` counts the rounds that are left."""
        kind = statement.kind
        self._loops = {} if self._loops is None else self._loops
        if kind is Keyword.WHILE and found.partner[here] < here:
            return found.partner[here] + 1 if self._condition(statement, block) else here + 1
        if kind is Keyword.WHILE:
            return here + 1 if self._condition(statement, block) else found.partner[here] + 1
        if kind is Keyword.END_WHILE:
            return found.partner[here]
        if kind is Keyword.REPEAT:
            left = self._loops.pop(here, None)
            left = round(self._value(statement.values[0], block)) if left is None and statement.values else left or 0
            if left <= 0:
                return found.partner[here] + 1
            self._loops[here] = left - 1
            return here + 1
        if kind is Keyword.END_REPEAT:
            return found.partner[here]
        loop = found.loop_of[here]
        if kind is Keyword.CONTINUE:
            return found.partner[loop]
        self._loops.pop(loop, None)
        return found.partner[loop] + 1

    def _macro_statement(self, block: Block, statement: Statement, here: int, found: Structure) -> int:
        """IF ... GOTO, IF ... THEN, GOTO, WHILE ... DO and END."""
        if statement.kind is Keyword.LOOP_END:
            return found.partner[here]
        holds = statement.condition is None or self._condition(statement, block)
        if statement.kind is Keyword.LOOP:
            return here + 1 if holds else found.partner[here] + 1
        if not holds:
            return here + 1
        if statement.kind is Keyword.IF_THEN:
            self.computed(block._replace(statement=None, assignments=statement.assignments))
            return here + 1
        return self._numbered_place(f"{self._value(statement.values[0], block):g}")

    def _numbered_place(self, number: str) -> int:
        """Return the place of the block N ``number``, looked for from here on, else from the beginning."""
        blocks, places = self.blocks.blocks, self.numbered(float(number))
        if places:
            return next((place for place in places if place > self.position), places[0])
        raise ProgramError(
            f"The program goes to N{number}, and there is no such block.",
            place=self.blocks.place(blocks[self.position].line),
            remedy="Correct the number, or put it in front of the block that is meant.",
        )

    # ---- calls -------------------------------------------------------------------------------------------------------------------

    def _call(self, statement: Statement, block: Block, found: Structure) -> None:
        """O ... CALL with its arguments in #1, #2 and so on."""
        place = self.blocks.place(block.line)
        if statement.label not in found.subs:
            raise ProgramError(
                f"O{statement.label} CALL calls a subprogram that the file does not have.",
                place=place,
                remedy=nearest(statement.label, found.subs) or "Write it in front of the call, from O... SUB to O... ENDSUB.",
            )
        if self.depth >= DEEPEST_CALL:
            raise ProgramError(
                f"O{statement.label} CALL calls more than {DEEPEST_CALL} programs deep.",
                place=place,
                remedy="A subprogram may not call itself.",
            )
        arguments = {number: self._value(value, block) for number, value in enumerate(statement.values, start=1)}
        begin = found.subs[statement.label]
        kept, loops = self.position, self._loops
        self.depth += 1
        self.variables.enter(arguments)
        self._loops = None
        self.run_blocks(begin + 1, found.partner[begin] + 1)
        self.variables.leave()
        self.depth -= 1
        self.position, self._loops = kept, loops

    def _give_back(self, statement: Statement, block: Block) -> None:
        if self.depth == 0:
            raise ProgramError(
                f"O{statement.label} {statement.kind} stands outside a subprogram.",
                place=self.blocks.place(block.line),
                remedy="Write M2 to end the program.",
            )
        self.variables.set_name("_VALUE_RETURNED", float(bool(statement.values)))
        if statement.values:
            self.variables.set_name("_VALUE", self._value(statement.values[0], block))

    def subprogram(self) -> None:
        """M98 P n L k calls the program O n k times; P 30012 calls O0012 three times. M97 calls from N n, G65 with variables of its own."""
        if self.has(Meaning.SUBPROGRAM_END):
            self._return()
        meaning = next((one for one in (Meaning.SUBPROGRAM, Meaning.LOCAL_SUBPROGRAM, Meaning.MACRO_CALL) if self.has(one)), None)
        if meaning is None:
            return
        code, p, repeats = self.block.codes[meaning].text, self.take("P"), self.take("L")
        if p is None or p.value < 0.0 or p.value != math.floor(p.value):
            raise self.error(f"{code} needs the number of a program.", f"Write it as {code} P0012.")
        number, times = int(p.value), 1 if repeats is None else int(repeats.value)
        known = self.blocks.locals if meaning is Meaning.LOCAL_SUBPROGRAM else self.blocks.subprograms
        if number not in known and number > MOST_CALLS and repeats is None:
            number, times = number % 10_000, number // 10_000
        letter = "N" if meaning is Meaning.LOCAL_SUBPROGRAM else "O"
        if number not in known:
            names = ", ".join(f"{letter}{key:04d}" for key in known)
            remedy = f"It has {names}." if names else f"Write it behind the M30 of the main program, from its {letter} number to M99."
            raise self.error(f"{code} calls the program {letter}{number:04d}, which the file does not have.", remedy)
        if self.depth >= DEEPEST_CALL:
            raise self.error(f"{code} calls more than {DEEPEST_CALL} programs deep.", "A program may not call itself.")
        if not 0 <= times <= MOST_CALLS:
            raise self.error(f"{code} repeats {times} times.", f"Repeat at most {MOST_CALLS} times.")
        arguments = self._arguments() if meaning is Meaning.MACRO_CALL else None
        self._run_subprogram(known[number], times, arguments)

    def _run_subprogram(self, blocks: tuple[Block, ...], times: int, arguments: dict[int, float] | None) -> None:
        kept = (self.blocks, self.block, self.block_number, self.used, self.position, self.passed)
        self.depth += 1
        if arguments is not None:
            self.variables.enter(arguments)
        for _ in range(times):
            if self.ended:
                break
            self.blocks, self.passed = replace(self.blocks, blocks=blocks), set()
            self.run_blocks()
            self.blocks = kept[0]
        if arguments is not None:
            self.variables.leave()
        self.depth -= 1
        self.blocks, self.block, self.block_number, self.used, self.position, self.passed = kept

    def _arguments(self) -> dict[int, float]:
        words: Iterable[str] = list(self.block.words)
        found = {}
        for letter in words:
            if letter in _ARGUMENTS and letter not in self.used:
                word = self.take(letter)
                found[_ARGUMENTS[letter]] = 0.0 if word is None else word.value
        return found

    def _return(self) -> None:
        """M99, or M99 P n, which goes to N n of the program that called; of the main program itself where none did."""
        code, p = self.block.codes[Meaning.SUBPROGRAM_END].text, self.take("P")
        if self.depth == 0 and p is None:
            self.warn(f"{code} in the main program begins it again on a machine; here it ends the program.")
            self.event("spindle")
            self.event("program_end")
            self.ended = True
        if p is not None:
            self.go_to = f"{p.value:g}"


def _code_number(value: float) -> float:
    """Return a computed number of a code with the rounding errors taken off."""
    return round(value, 4)
