function [s, voltage] = controller(s, reference, measured, correction, p, dac, period)
  % PID with conditional integration.
  err = reference - measured;
  slope = 0;
  if s.started
    slope = (err - s.before) / period;
  end
  total = s.sum + err * period;
  voltage = p.proportional * err + p.integral * total + p.derivative_gain * slope + correction;
  growth = p.integral * err;
  if (voltage > dac.largest_voltage && growth > 0) || (voltage < dac.smallest_voltage && growth < 0)
    total = s.sum;
    voltage = p.proportional * err + p.integral * total + p.derivative_gain * slope + correction;
  end
  voltage = max(dac.smallest_voltage, min(dac.largest_voltage, voltage));
  s.sum = total;
  s.before = err;
  s.started = true;
end
