function used = tool_wear(used, speed, touching, p, period)
  % Share of the tool's life used up, Taylor's law.
  if touching && speed >= p.slowest_cutting_speed
    logarithm = log(p.taylor_constant / speed) / p.taylor_exponent;
    used = used + period / (60 * exp(max(-60, min(60, logarithm))));
  end
end
