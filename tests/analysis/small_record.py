"""A record with what the figures look for: a tool that turns a shoulder off a bar, its contour error, voltages and a force."""

import numpy as np

from lathesim.record import Channel, Record


def shoulder() -> Record:
    """Return 4 s of turning: in contact from 1 s to 3 s, largest contour error there 20 um."""
    time = np.arange(801) * 5e-3
    z = np.interp(time, [0.0, 1.0, 3.0, 4.0], [0.050, 0.040, 0.020, 0.050])
    x = np.interp(time, [0.0, 1.0, 3.0, 3.2, 4.0], [0.025, 0.015, 0.015, 0.025, 0.025])
    contact = ((time >= 1.0) & (time <= 3.0)).astype(float)
    error = np.where(time < 0.5, 1e-3, 20e-6 * np.sin(2.0 * np.pi * time) ** 2)
    given = {
        "interpolator.x_reference": ("m", x),
        "interpolator.z_reference": ("m", z),
        "interpolator.cutting_block": ("1", contact),
        "x_axis.position": ("m", x + 1e-5),
        "z_axis.position": ("m", z),
        "x_axis.velocity": ("m/s", np.gradient(x, time)),
        "contour.contour_error": ("m", error),
        "cutting.in_contact": ("1", contact),
        "stock.material_radius": ("m", 0.018 + 0.0 * time),
        "stock.inside_stock": ("1", contact),
        "x_dac.voltage": ("V", 2.0 * np.sin(time)),
        "z_dac.voltage": ("V", np.cos(time)),
        "cutting_force.cutting_force": ("N", 1200.0 * contact),
    }
    channels = {name: Channel(name, unit, values) for name, (unit, values) in given.items()}
    return Record(time, channels, {"sample_period": 5e-3, "lesson_name": "shoulder"})
