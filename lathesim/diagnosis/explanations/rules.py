"""How a flexible explanation is looked for."""

from lathesim.diagnosis.method import Method


class Rules:
    """How a flexible explanation is looked for; of these numbers only ``sure`` decides."""

    sure = Method.tie_errors
    """Standard errors above which a term that predicts the validation recording better holds there; chance does so in 2.3 % of terms."""
    blocks = 40
    most_terms = 8
    most_waves = 3
    fitted = 3
    """Terms that are fitted jointly with those before in each round: the likeliest."""
    iterations = 30
    settled = 0.02
    """Change of the logarithms of all strengths with which they are found."""
    new = 1e-6
    """Share of a term that those before do not explain, for it to be another one."""
