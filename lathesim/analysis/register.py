"""The list of stock metrics, for the hook ``register_metrics``."""

from __future__ import annotations

from lathesim.analysis.metrics.metric import Metric


def stock_metrics() -> dict[str, Metric]:
    """Return the stock metrics by name, in the order in which they are shown."""
    from lathesim.analysis.metrics.chatter_metrics import CHATTER_METRICS
    from lathesim.analysis.metrics.circular_test import CIRCLE_METRICS
    from lathesim.analysis.metrics.cost_metrics import COST_METRICS
    from lathesim.analysis.metrics.motion_metrics import MOTION_METRICS
    from lathesim.analysis.metrics.turning_metrics import METRICS

    return {metric.name: metric for metric in (*METRICS, *COST_METRICS, *CIRCLE_METRICS, *CHATTER_METRICS, *MOTION_METRICS)}
