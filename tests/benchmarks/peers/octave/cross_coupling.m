function [s, voltage] = cross_coupling(s, deviation, p, period)
  % Cross-coupling controller: a PID of the sensed contour error.
  slope = 0;
  if s.started
    slope = (deviation - s.before) / period;
  end
  total = s.sum + deviation * period;
  voltage = p.proportional * deviation + p.integral * total + p.derivative_gain * slope;
  if abs(voltage) > p.largest_voltage && voltage * p.integral * deviation > 0
    total = s.sum;
    voltage = p.proportional * deviation + p.integral * total + p.derivative_gain * slope;
  end
  voltage = max(-p.largest_voltage, min(p.largest_voltage, voltage));
  s.sum = total;
  s.before = deviation;
  s.started = true;
end
