"""What a vibration is: chatter (Hopf or flip), forced vibration, segmentation, mains hum, a resonance rung by entry, or a stable cut.

Told apart by order, width, growth and modes, in this sequence. A steady line at a whole order is forced; one at a half order is a flip; one
at a multiple of 50 or 60 Hz that neither grows nor belongs to an order is hum. What decays after the cut begins, or after each entry of a
turn, is a resonance that was rung. A narrow line elsewhere that grew is chatter by a Hopf bifurcation. A wide one that was there from the
first turn on comes from chips that break in segments, or is a mode that the noise of the cut shakes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from lathesim.record import FloatArray
from lathesim.stability.signal_lines import TurnMemory, Vibration, VibrationLine, turn_memory, turn_shares, vibration
from lathesim.stability.stability_thresholds import GROWTH, ORDERS, REPEATS, SHARES, SHORT
from lathesim.units import in_unit

KINDS = ("stable", "hopf", "flip", "forced", "segmentation", "mains", "entry")
WORDS = {
    "stable": "a stable cut",
    "hopf": "chatter (Hopf bifurcation)",
    "flip": "chatter (flip bifurcation)",
    "forced": "forced vibration",
    "segmentation": "segmentation of the chip, or a mode shaken by the noise of the cut",
    "mains": "mains hum",
    "entry": "a resonance rung by entry",
}
_LAST = 3
"""Share of the recording, one over it, by which what grew is judged again."""
_MAINS = (50.0, 60.0)
_MAINS_MULTIPLES = 4
_MAINS_RESOLVED = 0.15
"""Of the resolution of the spectrum, by which the frequency of a hum may be off (assumed)."""
_BLOCK = 4.0
"""Vibrations of a block in which a ringing is looked for: one that is damped by 6 % has lost four fifths after as many."""
_BLOCKS_OF_A_TURN = 20


@dataclass(frozen=True)
class Judged:
    """What a vibration is, the line that decides, the mode (counted from 1, 0 for none) and what speaks for and against.

    ``runner_up`` is the kind that could not be excluded, empty where none.
    """

    kind: str
    line: VibrationLine | None
    mode: int = 0
    reasons: tuple[str, ...] = field(default=())
    runner_up: str = ""


def judge(found: Vibration, modes: tuple[float, ...] = (), quiet: Vibration | None = None) -> Judged:
    """Return what a vibration is; ``modes`` are known natural frequencies [Hz], ``quiet`` is the same signal while nothing is cut.

    A vibration that grew is judged by its last third as well: chatter is what it grew to.
    """
    judged = _judge_whole(found, modes, quiet)
    if judged.kind in ("hopf", "flip", "entry") or not _grew_to_the_end(found.values):
        return judged
    last = found.values[-(len(found.values) // _LAST) :]
    if len(last) * found.turning / found.rate < ORDERS.fewest_turns:
        return judged
    # its own mean says nothing of contact: that of the whole does
    at_last = _judge_whole(replace(vibration(last, found.rate, found.turning), modulation=found.modulation), modes, quiet)
    return at_last if at_last.kind in ("hopf", "flip") else judged


def _grew_to_the_end(values: FloatArray) -> bool:
    thirds = [float(part.std()) for part in np.array_split(values, _LAST)]
    return thirds[-1] > GROWTH.grew * thirds[0]


def _judge_whole(found: Vibration, modes: tuple[float, ...], quiet: Vibration | None) -> Judged:
    """Return what a vibration is by all of it."""
    orders, halves, hum, others = _sorted_lines(found, quiet)
    # the mean turn tells orders out of noise, and needs the speed; lines at low orders do not need it as exactly
    each_turn, each_other = turn_shares(found.values, found.rate, found.turning)
    whole = max(each_turn, sum(line.share for line in orders))
    half = max(halves, key=lambda line: line.share, default=None)
    half_share = sum(line.share for line in halves)
    hum_share = sum(line.share for line in hum)
    repeated = each_other > max(REPEATS.repeated, REPEATS.one_turn * found.rate / (len(found.values) * found.turning))
    flips = _are_a_flip(orders, halves, repeated) and half_share > SHARES.not_far_below * sum(line.share for line in others)
    if not flips:
        others = [*others, *halves]  # at a high order any line is near a half number
    # lines of a spectrum are no better than its resolution: what repeats every turn is none of the others
    other_share = min(sum(line.share for line in others), 1.0 - each_turn)
    strongest = max(others, key=lambda line: line.share, default=None)
    began = _rung_at_first(found)
    if began and not (strongest is not None and strongest.late >= GROWTH.grew and strongest.share > SHARES.rest):
        told = f"at its beginning the cut rings at {began:.0f} Hz, and the ringing dies out"
        return Judged("entry", strongest, _mode_of(began, modes), (told,))
    if half is not None and flips and half.late > 1.0 / GROWTH.grew:
        return Judged("flip", half, _mode_of(half.frequency, modes), (f"a line at order {half.order:.2f}, half a whole number",))
    counts = (
        other_share > SHARES.dominant * max(SHARES.rest, whole)
        and other_share >= hum_share
        and not _is_small(1.0 - whole - hum_share, found)
    )
    shaken = ""
    if strongest is not None and (counts or _outgrew(strongest)):
        # a mode that noise shakes may hide the line of the chip, which is not far below
        for line in sorted(others, key=lambda item: -item.share):
            if line.share < SHARES.not_far_below * strongest.share:
                break
            judged = _off_order(line, found, modes, other_share)
            if judged.kind not in ("stable", "segmentation") or (judged.kind == "segmentation" and other_share >= whole):
                return judged
            shaken = shaken or judged.reasons[-1]
    if hum_share > SHARES.dominant * max(SHARES.rest, whole) and hum:
        line = max(hum, key=lambda item: item.share)
        return Judged("mains", line, 0, (f"{line.frequency:.2f} Hz is a multiple of the mains frequency, and steady",))
    if _is_forced(whole, found):
        rung = _rung_each_turn(found)
        largest = max(orders, key=lambda item: item.share, default=None)
        if rung:
            return Judged("entry", largest, _mode_of(rung, modes), (f"each turn rings at {rung:.0f} Hz and dies down before the next",))
        return Judged("forced", largest, 0, (f"{in_unit(whole, '%', '.0f')} of the power is at whole orders of the spindle",))
    return Judged("stable", None, 0, (shaken or "no line stands out",))


def _memory(line: VibrationLine, found: Vibration) -> TurnMemory:
    return turn_memory(found.values, found.rate, found.turning, line.frequency)


def _is_small(share: float, found: Vibration) -> bool:
    """Whether a share of the power is within what every cutting force varies by; a signal without a mean has no such measure."""
    return found.modulation > 0.0 and math.sqrt(share) * found.modulation < SHARES.small_force


def _is_forced(whole: float, found: Vibration) -> bool:
    """Whether so much of the power at whole orders is more than the run-out of every cut."""
    return math.sqrt(2.0 * whole) * found.modulation > SHARES.forced_force if found.modulation > 0.0 else whole > SHARES.forced


def judge_line(found: Vibration, modes: tuple[float, ...] = ()) -> Judged:
    """Return what the one line of a vibration is, however small its share."""
    if not found.lines:
        return Judged("stable", None, 0, ("nothing stands out there",))
    orders, _, hum, _ = _sorted_lines(found, None)
    (line,) = found.lines
    if orders:
        return Judged("forced", line, 0, (f"it is order {line.order:.2f} of the spindle",))
    if hum:
        return Judged("mains", line, 0, (f"{line.frequency:.2f} Hz is a multiple of the mains frequency, and steady",))
    judged = _off_order(line, found, modes, line.share)
    # a band was asked about: what shakes a mode there is as much part of the cut as segments are
    return replace(judged, kind="segmentation") if judged.kind == "stable" else judged


def _sorted_lines(
    found: Vibration, quiet: Vibration | None
) -> tuple[list[VibrationLine], list[VibrationLine], list[VibrationLine], list[VibrationLine]]:
    """Return the lines at whole orders, at half ones, of the mains, and the others."""
    reach = 0.35 * found.resolution / found.turning
    orders, halves, hum, others = [], [], [], []
    still = [line.frequency for line in quiet.lines] if quiet is not None else []
    for line in found.lines:
        part = abs(line.order - round(line.order))
        near = min(ORDERS.whole, ORDERS.whole_at_zero + ORDERS.whole_each * line.order) + reach
        was_there = any(abs(line.frequency - other) < found.resolution for other in still)
        if was_there or (_is_mains(line, found.resolution) and part >= 0.5 * near):
            hum.append(line)
        elif part < near and not line.is_wide and line.late < GROWTH.outgrew and _repeats_itself(line, found, orders=True):
            orders.append(line)
        elif abs(part - 0.5) < near and not line.is_wide and _repeats_itself(line, found, orders=False):
            halves.append(line)
        else:
            others.append(line)
    return orders, halves, hum, others


def _repeats_itself(line: VibrationLine, found: Vibration, *, orders: bool) -> bool:
    """Whether a line at a whole or half order repeats itself from turn to turn, and is not noise that lies there by chance."""
    return turn_memory(found.values, found.rate, found.turning, line.frequency, orders=orders).kept > REPEATS.order_keeps


def _are_a_flip(orders: list[VibrationLine], halves: list[VibrationLine], repeated: bool) -> bool:
    """Whether lines at half orders belong to a flip: only an interrupted cut flips, and several of its half orders show.

    Two are enough where they are large, and one where the mean of turns with alternating signs holds more than chance would leave there.
    """
    numbers = {round(line.order - 0.5) for line in halves}
    enough = len(numbers) >= SHARES.flip_lines or (len(numbers) >= 2 and sum(line.share for line in halves) > SHARES.flip)
    enough = enough or (repeated and len(numbers) > 0)
    return enough and sum(line.share for line in orders) > SHARES.least_orders


def _rung_at_first(found: Vibration) -> float:
    """Return the frequency [Hz] of a ringing at the beginning of the record that has died out soon, 0 where there is none."""
    high = sosfiltfilt(butter(4, min(1.6 * found.turning / (0.5 * found.rate), 0.9), "highpass", output="sos"), found.values)
    strongest = float(np.fft.rfftfreq(len(high), 1.0 / found.rate)[1 + int(np.argmax(np.abs(np.fft.rfft(high))[1:]))])
    block = max(8, int(min(0.25 / found.turning, _BLOCK / strongest) * found.rate))
    count = len(high) // block
    if count < SHORT.ringing:
        return 0.0
    size = np.sqrt((high[: count * block].reshape(count, block) ** 2).mean(axis=1))
    later = float(np.sqrt((size[count // 2 :] ** 2).mean()))
    first = int(np.argmax(size[: count // 2]))  # a recording may begin before the cut does
    if size[first] < GROWTH.rung_at_first * later:
        return 0.0
    length = min(len(high) - first * block, 16 * block)
    piece = high[first * block : first * block + length]
    return float(np.fft.rfftfreq(4 * length, 1.0 / found.rate)[int(np.argmax(np.abs(np.fft.rfft(piece, 4 * length))))])


def _is_mains(line: VibrationLine, resolution: float) -> bool:
    if line.is_wide or not 1.0 / GROWTH.grew < line.late < GROWTH.grew:
        return False
    hums = [multiple * mains for mains in _MAINS for multiple in range(1, _MAINS_MULTIPLES + 1)]
    return any(abs(line.frequency - hum) < ORDERS.mains_near * hum + _MAINS_RESOLVED * resolution for hum in hums)


def _outgrew(line: VibrationLine) -> bool:
    """Whether a line grew so much that it stands for what comes, however small its share still is."""
    return line.late > GROWTH.outgrew and line.share > SHARES.least_grown and not line.is_wide


def _off_order(line: VibrationLine, found: Vibration, modes: tuple[float, ...], share: float) -> Judged:
    """Return what a line off the orders is; ``share`` is that of all such lines."""
    mode = _mode_of(line.frequency, modes)
    near = f", a little above mode {mode} ({modes[mode - 1]:.1f} Hz)" if mode else ""
    where = f"a line at {line.frequency:.1f} Hz, order {line.order:.2f}, no whole one{near}"
    if line.late < GROWTH.died and line.rate < 0.0:
        return Judged("entry", line, mode, (where, "it decays from the beginning of the cut"))
    if line.late < GROWTH.grew and found.modulation > SHARES.leaves_the_cut and share > SHARES.dominant:
        return Judged("hopf", line, mode, (where, "the force swings so far that the tool leaves the cut"))
    memory = _memory(line, found)
    grew = line.late >= GROWTH.grew and _grew_beyond_chance(line, memory, found)
    repeats = memory.kept >= REPEATS.keeps and (memory.variation <= REPEATS.steady or line.late >= GROWTH.grew)
    if not repeats and not grew:
        kept = f"it keeps {in_unit(memory.kept, '%', '.0f')} of itself from turn to turn"
        open_still = "hopf" if mode and memory.kept > REPEATS.order_keeps else ""
        if memory.is_steady:
            return Judged("segmentation", line, mode, (where, f"{kept}, and its amplitude is steady from the first turns on"), open_still)
        if found.departure > REPEATS.impulsive:
            return Judged("segmentation", line, mode, (where, f"{kept}, and it is struck again and again"), open_still)
        wanders = in_unit(memory.variation, "%", ".0f")
        told = f"noise of the cut shakes a mode at {line.frequency:.0f} Hz: its amplitude wanders by {wanders}"
        return Judged("stable", line, mode, (where, told))
    if line.late >= GROWTH.grew:
        return Judged("hopf", line, mode, (where, f"its amplitude grew {line.late:.1f} times"))
    if modes and not mode:
        return Judged("segmentation", line, 0, (where, "it is narrow, did not grow, and no mode lies near it"), "hopf")
    return Judged("hopf", line, mode, (where, "it is narrow; how it began was not recorded"), "segmentation")


def _grew_beyond_chance(line: VibrationLine, memory: TurnMemory, found: Vibration) -> bool:
    """Whether a vibration grew by more than the amplitude of noise would have by chance, by the F distribution of two powers; or grew, and
    is narrower than noise makes a mode.

    A seventh of the recording is behind each power, and half of it behind the memory. A mode of damping zeta that noise shakes has
    2 pi zeta f T independent values in a time T.
    """
    seconds = 0.5 * len(found.values) / found.rate
    if memory.independent < 2.0 * math.pi * REPEATS.least_damping * line.frequency * seconds:
        return True
    from scipy.stats import f as ratio_of_powers

    degrees = 2.0 * max(1.0, 2.0 * memory.independent / 7.0)
    return bool(ratio_of_powers.sf(line.late**2, degrees, degrees) < REPEATS.by_chance)


def _mode_of(frequency: float, modes: tuple[float, ...]) -> int:
    """Return the mode, counted from 1, above which chatter at a frequency would lie; 0 where there is none."""
    above = {number: frequency / natural - 1.0 for number, natural in enumerate(modes, 1)}
    near = [number for number, share in above.items() if GROWTH.below_a_mode <= share <= GROWTH.above_a_mode]
    return min(near, key=lambda number: abs(above[number]), default=0)


def _rung_each_turn(found: Vibration) -> float:
    """Return the frequency [Hz] at which each turn rings and dies down, 0 where none does."""
    samples = found.rate / found.turning
    count = int(samples)
    turns = int(len(found.values) / samples)
    if turns < SHORT.turns or count < SHORT.of_a_turn:
        return 0.0
    places = (np.arange(turns)[:, None] + np.arange(count)[None, :] / count) * samples
    spectrum = np.fft.rfft(np.interp(places, np.arange(len(found.values)), found.values).mean(axis=0))
    size = np.abs(spectrum)
    size[0] = 0.0
    if len(size) <= GROWTH.high_order + 1:
        return 0.0
    top = GROWTH.high_order + int(np.argmax(size[GROWTH.high_order :]))
    if size[top] < 0.5 * size[1 : GROWTH.high_order].max() or top < GROWTH.high_order:
        return 0.0
    band = np.zeros_like(spectrum)
    low = max(GROWTH.high_order - 1, int(0.5 * top))
    band[low : int(1.7 * top) + 1] = spectrum[low : int(1.7 * top) + 1]
    whole = np.zeros(count, dtype=np.complex128)
    whole[: len(band)] = 2.0 * band
    envelope = np.abs(np.fft.ifft(whole))
    blocks = np.array([block.mean() for block in np.array_split(envelope, min(_BLOCKS_OF_A_TURN, count // 4))])
    turned = np.roll(blocks, -int(np.argmax(blocks)))
    died = np.flatnonzero(turned < turned[0] / GROWTH.rung_in_a_turn)
    # it dies down without a rise between; after that the exit from the cut may ring as well
    rings = len(died) > 0 and bool((np.diff(turned[: died[0] + 1]) < GROWTH.rings_on * turned[0]).all())
    return float(top * found.turning) if rings else 0.0
