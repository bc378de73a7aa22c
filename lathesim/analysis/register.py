"""The list of stock metrics, for the hook ``register_metrics``."""

from __future__ import annotations

from lathesim.analysis.metric import Metric


def stock_metrics() -> dict[str, Metric]:
    """Return the stock metrics by name, in the order in which they are shown."""
    from lathesim.analysis.chatter_metrics import CHATTER_METRICS
    from lathesim.analysis.circular_test import CIRCLE_METRICS
    from lathesim.analysis.cost_metrics import COST_METRICS
    from lathesim.analysis.metrics import METRICS
    from lathesim.analysis.motion_metrics import MOTION_METRICS

    return {metric.name: metric for metric in (*METRICS, *COST_METRICS, *CIRCLE_METRICS, *CHATTER_METRICS, *MOTION_METRICS)}
