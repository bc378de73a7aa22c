function voltage = tachometer(speed, angle, chance, p)
  % Tachometer with noise, bias and ripple.
  voltage = p.gain * speed + p.bias + p.noise * chance + p.ripple * sin(p.ripples * angle);
end
