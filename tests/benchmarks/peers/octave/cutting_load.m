function [x_load, z_load, torque] = cutting_load(cutting, longitudinal, radial, radius, x_velocity, z_velocity, spindle_speed, free_end, p)
  % What the cut does to axes and spindle, equation (22).
  along = sqrt(x_velocity * x_velocity + z_velocity * z_velocity + p.slowest_feed * p.slowest_feed);
  feed_x = x_velocity / along;
  feed_z = z_velocity / along;
  away_x = -feed_z;
  away_z = feed_x;
  outward = away_z;
  if free_end < 0
    outward = -away_z;
  end
  if away_x + outward < 0
    away_x = feed_z;
    away_z = -feed_x;
  end
  torque = radius * cutting * spindle_speed / sqrt(spindle_speed * spindle_speed + p.slowest_spindle * p.slowest_spindle);
  x_load = longitudinal * feed_x - radial * away_x;
  z_load = longitudinal * feed_z - radial * away_z;
end
