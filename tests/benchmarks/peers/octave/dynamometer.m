function voltage = dynamometer(force, chance, p)
  % Dynamometer with noise and bias.
  voltage = p.gain * force + p.bias + p.noise * chance;
end
