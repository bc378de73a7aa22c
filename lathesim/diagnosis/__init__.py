"""Name the physics that a simulation left out, from recordings: ``diagnose.py`` is the method, step by step.

1. ``preparation.py``: a lesson, its recordings and the effects to try; ``method/``: the numbers that decide, with their evidence.
2. ``recording_checks/``: is a recording at fault? (exchanged channels, mistaken unit, sample clock, clipping, ...)
3. ``location.py``: what is missing, and where it acts.
4. ``candidates/``: which effects may be tried, and from which values.
5. ``explaining/``: the search; ``density.py`` is the one measure, ``chance.py`` and ``resolution.py`` say when a model is better.
6. ``explanations/``: the flexible explanation of what is left.
7. ``verdict.py``: ties, doubts, and the verdict, which follows from what predicts best.
8. ``discovery/``: a formula where no effect explains what is missing.
9. ``answer.py`` and ``reporting/``: the words, figures and page of the answer; ``comparison/``: the engine of ``lathesim compare``.

The effects themselves, as a friction that depends on the direction, are parts in ``lathesim/effects/``. Simulators, noise models and fits
stand in ``lathesim/identification/``. The nouns between two steps stand in ``records/``.
"""
