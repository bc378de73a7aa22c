function [acceleration, velocity] = drive(speed, voltage, load, p)
  % Axis or spindle as a first-order lag, equation (9).
  acceleration = (p.gain * voltage - p.disturbance_gain * load - speed) / p.time_constant;
  velocity = speed;
end
