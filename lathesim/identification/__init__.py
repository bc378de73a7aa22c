"""System identification: a machine's simulators beside its recordings, and parameters fitted to them. It knows no verdict.

From below: ``execution`` (threads, budget, cache); ``signal``, ``noise`` and ``machine`` (spectra, resolution, roles of parts); ``records``
(the nouns); ``catalogue`` (effects placed in a machine); ``replay`` (a recording with its simulators); ``estimation`` (least squares and
its errors).
"""
