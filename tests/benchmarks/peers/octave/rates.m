function rate = rates(s, held, p)
  % The derivative of (x speed, x, z speed, z, spindle speed, spindle angle).
  [depth, feed, speed, radius, touching] = cutting_geometry(s(2), s(1), s(3), s(5), held.uncut, held.standing, held.cutting_block, p.cutting);
  [cutting, longitudinal, radial] = cutting_force(depth, feed, speed, touching, held.wear_factor, p.cutting_force);
  [x_load, z_load, torque] = cutting_load(cutting, longitudinal, radial, radius, s(1), s(3), s(5), p.stock.free_end, p.load);
  rate = zeros(1, 6);
  [rate(1), rate(2)] = drive(s(1), held.x_volts, x_load, p.x_axis);
  [rate(3), rate(4)] = drive(s(3), held.z_volts, z_load, p.z_axis);
  [rate(5), rate(6)] = drive(s(5), held.spindle_volts, torque, p.spindle);
end
