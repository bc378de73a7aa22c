"""How much reports and comparisons show. No answer depends on these numbers."""


class Shown:
    """How much reports and comparisons show."""

    windows = 50
    """Stretches of a recording of which the worst is said."""
    nearest_parts = 4
    """Parts of a chain that are named at most."""
    most_bars = 8
    """Variables of which a bar is drawn at most."""
    least_bar = 0.01
    """Share that a variable must explain for its bar to be drawn."""
    most_rows = 6
    """Channels, and effects that were tried, in a table of the page at most."""
    most_drawings = 2
    """Drawings of channels on the page at most."""
    most_variables = 4
    """Variables that are named at most."""
    hardly_shown = 0.01
    """Noise floors below which a value is said to move nothing: some ten thousand samples average noise down to that."""
    most_named = 3
    """Values, effects or channels that one line of the answer names at most."""
    hardly_worse = 1.05
    """Ratio of the errors after and before up to which a channel is called slightly worse."""
    far_apart = 3.0
    """Times what tells two effects apart from which on a figure draws them alike."""
