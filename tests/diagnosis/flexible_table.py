"""What a flexible function of the operating conditions predicts of real recordings: ``python -m tests.diagnosis.flexible_table``.

The lesson is fitted without any effect; each channel that is left above its floor is asked what it depends on, once with its own residual,
or with the force that it lacks behind a moving part. Needs the recordings beside the project. Name cases to see only those.
"""

from __future__ import annotations

import sys
import time
import warnings

from lathesim.diagnosis.explanations.of_recording import conditions_of, of_channels
from lathesim.effects.effect import Effect
from lathesim.identification.catalogue.placement import insert_candidates
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.estimation.transfer import transferred
from lathesim.identification.replay.experiment import Experiment, baseline_free, build_experiments
from lathesim.identification.replay.loading import load_case
from lathesim.identification.replay.validation_split import parted
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from tests.diagnosis.explanations.nearest import nearest_effects
from tests.diagnosis.real.cases import Case
from tests.diagnosis.real.recordings import cases

HEADS = ("case", "channel: what is missing", "gain, nats", "held out", "it ...", "nearest, of the whole or a part", "CPU s")


def experiments_of(case: Case) -> tuple[Experiment, Experiment]:
    """Return the estimation and the validation recording of a case, in its machine without candidates."""
    files = [case.file(name) for name in (case.fitted, case.validation) if name]
    loaded = load_case(load_lesson(case.file(case.lesson)), files, load_registry(installed=False))
    named = [(one.name, one.record) for one in loaded.recordings]
    if len(named) == 1:
        first, second, *_ = parted(loaded.machine, *named[0], ())
        return first, second
    first, second = build_experiments(loaded.machine, named, ())
    return first, second


def rows_of(case: Case) -> list[str]:
    """Return the lines of a case, one for each channel."""
    first, second = experiments_of(case)
    fitted = fit(first.sensed, [*baseline_free(first.machine), *first.start_states(first.sensed.plan)])
    judged = transferred(second, fitted, ())
    begun = time.process_time()
    asked = of_channels(first, fitted, second, judged)
    spent = (time.process_time() - begun) / max(len(asked), 1)
    effects = [one for one in load_registry(installed=False).effects.values() if issubclass(one, Effect)]
    candidates = insert_candidates(first.machine.assembly, effects, first.machine.compare)[1]
    conditions, found = conditions_of(first), []
    for channel, (missing, one) in asked.items():
        terms = "; ".join(f"{part} ({part.gain:.0f})" for part in one.parts) or "nothing"
        place = missing.at.partition(".")[0]
        beside = [candidate for candidate in candidates if candidate.at.partition(".")[0] == place]
        near = nearest_effects(one, beside, conditions, missing.shows)[:2]
        found.append(
            f"| {case.name} | {channel}: {missing.at} | {one.gain:.0f} +- {one.standard_error:.0f} | {one.before:.3g} -> {one.after:.3g} "
            f"{missing.unit} | {terms} | {'; '.join(map(str, near)) or '-'} | {spent:.2f} |"
        )
    return found


def main(names: list[str]) -> None:
    """Print the table of the named cases, or of all."""
    warnings.simplefilter("ignore")
    print(f"| {' | '.join(HEADS)} |\n|{'---|' * len(HEADS)}")
    for case in cases(every_lesson=bool(names)):
        if not names or case.name in names:
            print(f"| {case.name} | truth: {case.truth} | | | | | |", *rows_of(case), sep="\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
