function level = nearest_level(voltage, c)
  % The nearest level of a converter.
  quantum = (c.largest_voltage - c.smallest_voltage) / (2 ^ c.bits - 1);
  if voltage <= c.smallest_voltage
    level = c.smallest_voltage;
  elseif voltage >= c.largest_voltage
    level = c.largest_voltage;
  else
    level = c.smallest_voltage + floor((voltage - c.smallest_voltage) / quantum + 0.5) * quantum;
  end
end
