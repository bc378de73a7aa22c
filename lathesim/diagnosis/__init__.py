"""Name the physics that a simulation left out, from recordings: ``diagnose.py`` is the method, step by step.

1. ``question.py``: a lesson, its recordings and the effects to try; ``method.py``: the limits of every decision.
2. ``recording_checks/``: is a recording at fault? (exchanged channels, mistaken unit, sample clock, clipping, change points, ...)
3. ``location/``: what is missing, where it acts, what it depends on (missing force, operating conditions, narrow bands, ...)
4. ``candidates/``: which effects may be tried, and from which values.
5. ``selection/``: the search; ``acceptance.py`` says when an effect is accepted, ``moves/`` what is tried with an accepted one.
6. ``verdict/``: tests of what is left, ties, and the decision.
7. ``discovery/``: a formula where no effect explains what is missing.
8. ``reporting/``: the words, figures and page of the answer; ``comparison/``: the engine of ``lathesim compare``.

The effects themselves, as a friction that depends on the direction, are parts in ``lathesim/effects/``. Simulators, noise models and fits
stand in ``lathesim/identification/``. The nouns between two steps stand in ``records/``.
"""
