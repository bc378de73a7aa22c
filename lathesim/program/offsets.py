"""Where coordinates begin and which tool cuts: work offsets, origin shifts, G10, reference points, nose compensation.

Source: LinuxCNC 2.9 manual, G10, G28, G30, G41, G52, G54, G92; Fanuc 0i-T operator's manual, coordinate system, G10, tool nose radius
compensation.
"""

from __future__ import annotations

from dataclasses import replace

from lathesim.program.flow import Flow
from lathesim.program.meanings import Group, Meaning
from lathesim.program.moves import LEFT, ORIENTATIONS, RIGHT, Nose, Tool, nose
from lathesim.units import in_unit

_SIDES = {
    Meaning.COMPENSATION_LEFT: LEFT, Meaning.COMPENSATION_GIVEN_LEFT: LEFT, Meaning.COMPENSATION_RIGHT: RIGHT,
    Meaning.COMPENSATION_GIVEN_RIGHT: RIGHT,
}  # fmt: skip
_GIVEN = (Meaning.COMPENSATION_GIVEN_LEFT, Meaning.COMPENSATION_GIVEN_RIGHT)
_SAME = 1e-9
_WITHOUT, _WORK_DATA = 0.0, (2.0, 20.0)
"""The L of G10 that is left out, and those that set a work offset: as named, and from the present position."""
_FURTHER_OFFSETS = 300
"""Work offsets of G54.1 and G154. Source: Fanuc 0i-T operator's manual; Haas has 99 of them."""
_GEOMETRY = 10_000
"""P of G10 above it are geometry offsets of tools. Source: Fanuc 0i-T operator's manual, changing of tool offset amount."""


class Offsets(Flow):
    """The steps of a block that set offsets, shifts, reference points and nose compensation."""

    strict = False

    # ---- nose compensation -------------------------------------------------------------------------------------------------------

    def plane(self) -> None:
        """Set the plane of the motions: XZ, or XY for drilling along Z."""
        meaning = self.block.of_group(Group.PLANE)
        if meaning is not None:
            if self.modal.nose is not None and meaning is not Meaning.PLANE_XZ:
                raise self.error(
                    f"{self.block.codes[meaning].text} changes the plane while nose compensation is on.", "Write G40 before it."
                )
            self.modal.plane = meaning

    def compensation(self) -> None:
        """G40 to G42, and the choice of a work offset."""
        self._work_offset()
        self._length_offset()
        meaning = self.block.of_group(Group.COMPENSATION)
        modal = self.modal
        if meaning is None:
            return
        if meaning is Meaning.COMPENSATION_OFF:
            modal.side, modal.nose = 0, None
            return
        code = self.block.codes[meaning].text
        self.check_plane(code)
        modal.side = _SIDES[meaning]
        tool = self._given_nose(code) if meaning in _GIVEN else self._tool_of_nose(code)
        if tool.radius == 0.0:
            modal.nose = None
            self.assumed["nose_compensation"] = "a nose radius of 0: the tool point runs along the programmed path"
            self.warn(f"{code} is read with a nose radius of 0: the tool point runs along the programmed path.")
            return
        modal.nose = self._nose(tool)

    def _nose(self, tool: Tool) -> Nose:
        return nose(self.modal.side, tool, front=self.dialect.tool_in_front, starts_beside=self.dialect.nose_starts_beside)

    def _given_nose(self, code: str) -> Tool:
        """G41.1 and G42.1: D is the diameter of the nose, L its orientation."""
        d, orientation = self.take("D"), self.take("L")
        if d is None or d.value < 0.0:
            raise self.error(f"{code} needs the diameter of the nose.", f"Write it as {code} D0.8 L2.")
        return Tool(0.5 * self.modal.metres(d.value), self._orientation(orientation.value if orientation is not None else 0.0, code))

    def _tool_of_nose(self, code: str) -> Tool:
        """G41 and G42: the tool in use, or that of D."""
        d = self.take("D")
        if d is not None and (
            d.value != int(d.value) or not d.value >= 0 or (int(d.value) not in self.modal.tools and d.value > self.stations)
        ):
            raise self.error(f"{d.text} of {code} names an offset that there is not.", "Give the number of a tool of the turret.")
        number = int(d.value) if d is not None else self.modal.offset_of_tool or self.modal.tool or 0
        return self.modal.tools.get(number, Tool())

    def _orientation(self, value: float, code: str) -> int:
        if value not in ORIENTATIONS:
            raise self.error(f"{value:g} is no orientation of a tool for {code}.", "Orientations count from 0 to 9.")
        return int(value)

    def offset_of_tool(self, number: int) -> None:
        """Take over the offset that a T word calls; a compensation in force goes on with its nose."""
        modal = self.modal
        modal.offset_of_tool = number
        tool = modal.tools.get(number, Tool())
        modal.tool_offset = (tool.x, tool.z)
        if modal.side:
            modal.nose = self._nose(tool) if tool.radius else None

    # ---- coordinates -------------------------------------------------------------------------------------------------------------

    def _work_offset(self) -> None:
        meaning = self.block.of_group(Group.COORDINATES)
        if meaning is None:
            return
        word = self.block.codes[meaning]
        if meaning is Meaning.OFFSET_FURTHER:
            self.modal.offset_number = self._further_offset(word.text)
        else:
            self.modal.offset_number = self.dialect.work_offsets[word.code]
        if meaning is not Meaning.OFFSET_FIRST and self.modal.offset_number not in self.modal.offsets:
            self.assumed["work_offsets"] = "all zero"
            self.warn(f"{word.text} is read with an offset of 0.")

    def _further_offset(self, code: str) -> int:
        """Return the number of the work offset that P of G54.1 or G154 names: they count on behind those with a code of their own.

        Source: Fanuc 0i-T operator's manual, additional workpiece coordinate systems; Haas lathe operator's manual, G154.
        """
        p = self.take("P")
        if p is None or p.value != int(p.value) or not 1 <= p.value <= _FURTHER_OFFSETS:
            raise self.error(f"{code} needs the number of a work offset.", f"Write it as {code} P1, up to P{_FURTHER_OFFSETS}.")
        return len(self.dialect.work_offsets) + int(p.value)

    def _length_offset(self) -> None:
        """G43 takes over the offsets of the tool in use, or of H; G49 takes them out."""
        meaning = self.block.of_group(Group.LENGTH)
        if meaning is Meaning.LENGTH_OFF:
            self.modal.tool_offset = (0.0, 0.0)
        elif meaning is Meaning.LENGTH_ON:
            h = self.take("H")
            number = (self.modal.tool or 0) if h is None else int(h.value)
            if h is not None and (h.value != number or not 0 <= number <= self.stations):
                raise self.error(f"{h.text} names an offset that there is not.", "Give the number of a tool of the turret.")
            tool = self.modal.tools.get(number, Tool())
            self.modal.tool_offset = (tool.x, tool.z)

    def _named(self, *letters: str) -> dict[str, float]:
        """Return the lengths [m] of these words of the block, X and U halved while X is a diameter."""
        modal, found = self.modal, {}
        for letter in letters:
            word = self.take(letter)
            if word is not None:
                found[letter] = modal.metres(word.value) * (0.5 if modal.diameter and letter in "XU" else 1.0)
        return found

    def once(self) -> None:
        """The codes that act in their block only."""
        if self.has(Meaning.SET_DATA):
            self._set_data()
        elif self.has(Meaning.SHIFT) or self.has(Meaning.SPINDLE_LIMIT):
            self._shift()
        elif self.has(Meaning.SHIFT_LOCAL):
            self._shift_local()
        elif self.has(Meaning.HOME_SET) or self.has(Meaning.HOME_SET_SECOND):
            which = Meaning.HOME if self.has(Meaning.HOME_SET) else Meaning.HOME_SECOND
            self.modal.homes[which] = (self.modal.x, self.modal.z)
        elif self.has(Meaning.HOME) or self.has(Meaning.HOME_SECOND):
            self._home(Meaning.HOME if self.has(Meaning.HOME) else Meaning.HOME_SECOND)
        else:
            self._shift_modes()

    def _shift(self) -> None:
        """The present position gets the coordinates of the block; U and W move the origin by so much."""
        modal = self.modal
        meaning = Meaning.SHIFT if self.has(Meaning.SHIFT) else Meaning.SPINDLE_LIMIT
        given = self._named("X", "Z", *(self.dialect.incremental or {}))
        if not given:
            if meaning is Meaning.SHIFT:
                raise self.error(f"{self.block.codes[meaning].text} shifts the origin and names no axis.", "Add an X or a Z word.")
            return
        x, z = modal.here
        if "X" in given:
            modal.shift_x += x - given["X"]
        if "Z" in given:
            modal.shift_z += z - given["Z"]
        modal.shift_x -= given.get("U", 0.0)
        modal.shift_z -= given.get("W", 0.0)
        modal.shift_kept = (modal.shift_x, modal.shift_z)
        if meaning is Meaning.SPINDLE_LIMIT and (abs(modal.shift_x) > _SAME or abs(modal.shift_z) > _SAME):
            self.warn(
                f"{self.block.codes[meaning].text} puts the origin to X {in_unit(modal.shift_x, 'mm', '.6g')} (radius), "
                f"Z {in_unit(modal.shift_z, 'mm', '.6g')}, as the tool stands at X {in_unit(modal.x, 'mm', '.6g')} (radius), "
                f"Z {in_unit(modal.z, 'mm', '.6g')}."
            )

    def _shift_local(self) -> None:
        given = self._named("X", "Z")
        if not given:
            raise self.error(f"{self.block.codes[Meaning.SHIFT_LOCAL].text} shifts the origin and names no axis.", "Add an X or a Z word.")
        modal = self.modal
        if self.dialect.local_shift_is_shift:
            modal.shift_x, modal.shift_z = given.get("X", modal.shift_x), given.get("Z", modal.shift_z)
            modal.shift_kept = (modal.shift_x, modal.shift_z)
        else:
            modal.local = (given.get("X", modal.local[0]), given.get("Z", modal.local[1]))

    def _shift_modes(self) -> None:
        modal = self.modal
        if self.has(Meaning.SHIFT_OFF):
            modal.shift_x = modal.shift_z = 0.0
            modal.shift_kept = (0.0, 0.0)
        elif self.has(Meaning.SHIFT_SUSPENDED):
            modal.shift_x = modal.shift_z = 0.0
        elif self.has(Meaning.SHIFT_RESTORED):
            modal.shift_x, modal.shift_z = modal.shift_kept

    def _home(self, which: Meaning) -> None:
        """Over the point of the block, if it names one, to the reference point; without axes all of them go there."""
        modal, nose_kept = self.modal, self.modal.nose
        modal.nose = None
        if which is Meaning.HOME_SECOND:
            self.take("P")
        named = [letter for letter in ("X", "Z", "U", "W") if letter in self.block.words]
        if named:
            self.add("rapid", self.target(self.dialect.home_incremental))
        x_home = not named or "X" in named or "U" in named
        z_home = not named or "Z" in named or "W" in named
        zero = modal.homes.get(which, self.dialect.machine_zero)
        self.assumed["reference_point"] = f"X{1e3 * zero[0]:g} Z{1e3 * zero[1]:g} mm, X as a radius"
        self.add("rapid", (zero[0] if x_home else modal.x, zero[1] if z_home else modal.z))
        modal.nose = nose_kept

    # ---- G10 ---------------------------------------------------------------------------------------------------------------------

    def _set_data(self) -> None:
        """Set a work offset (L2, L20) or a tool (L1, and on Fanuc also without L)."""
        code = self.block.codes[Meaning.SET_DATA].text
        kind, p = self.take("L"), self.take("P")
        number = -1 if p is None else int(p.value)
        if p is None or number < 0 or p.value != number:
            raise self.error(f"{code} needs the number of an offset.", f"Write it as {code} L2 P1 X0 Z0.")
        sort = kind.value if kind is not None else _WITHOUT
        if sort in _WORK_DATA:
            further = sort == _WORK_DATA[1] and self.dialect.further_by_l20
            first, last = (1, _FURTHER_OFFSETS) if further else (0, len(self.dialect.work_offsets))
            if not first <= number <= last:
                raise self.error(f"P{number} of {code} is no work offset.", f"There are P1 to P{last}.")
            number += len(self.dialect.work_offsets) if further else 0
            self._set_work_offset(code, number, from_here=sort == _WORK_DATA[1] and not further)
        elif sort in self.dialect.tool_data:
            self._set_tool(code, number)
        else:
            shown = kind.text if kind is not None else "no L"
            kinds = "L2 and L20 (work offset), " + ("and no L, L10 or L11 (tool)" if _WITHOUT in self.dialect.tool_data else "L1 (tool)")
            raise self.error(f"{code} with {shown} is not interpreted.", f"There are {kinds}.")

    def _set_work_offset(self, code: str, number: int, *, from_here: bool) -> None:
        modal = self.modal
        r = self.take("R")
        if r is not None and r.value != 0.0:
            raise self.error(f"{r.text} of {code} turns the coordinates, and a lathe has no such plane.", "Leave R out.")
        number = number or modal.offset_number
        given = self._named("X", "Z", *(self.dialect.home_incremental or self.dialect.incremental or {}))
        x, z = modal.offsets.get(number, (0.0, 0.0))
        if from_here:
            work = modal.offsets.get(modal.offset_number, (0.0, 0.0))
            here = (modal.here[0] + work[0], modal.here[1] + work[1])
            given = {letter: here[0 if letter == "X" else 1] - value for letter, value in given.items()}
        modal.offsets[number] = (given.get("X", x) + given.get("U", 0.0), given.get("Z", z) + given.get("W", 0.0))

    def _set_tool(self, code: str, number: int) -> None:
        modal = self.modal
        number = number - _GEOMETRY if number > _GEOMETRY else number
        tool = modal.tools.get(number, Tool())
        given = self._named("X", "Z", *(self.dialect.home_incremental or self.dialect.incremental or {}))
        radius, orientation = self.take("R"), self.take("Q")
        if radius is not None and radius.value < 0.0:
            raise self.error(f"{radius.text} of {code} is a negative nose radius.", "Give it without a sign.")
        modal.tools[number] = replace(
            tool,
            x=given.get("X", tool.x) + given.get("U", 0.0),
            z=given.get("Z", tool.z) + given.get("W", 0.0),
            radius=tool.radius if radius is None else modal.metres(radius.value),
            orientation=tool.orientation if orientation is None else self._orientation(orientation.value, code),
        )
        if self.dialect.tool_data_at_once and number == modal.offset_of_tool:
            modal.tool_offset = (modal.tools[number].x, modal.tools[number].z)
