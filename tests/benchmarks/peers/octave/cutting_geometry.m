function [depth, feed, speed, radius, touching] = cutting_geometry(x, x_velocity, z_velocity, spindle_speed, uncut, standing, cutting_block, p)
  % Depth of cut, feed and cutting speed as they are.
  turning = abs(spindle_speed);
  radius = max(x, 0);
  speed = turning * radius;
  depth = 0;
  feed = 0;
  touching = standing > x && cutting_block;
  if touching
    depth = max(uncut - x, 0);
    if turning > p.slowest_spindle
      feed = 2 * pi / turning * min(sqrt(x_velocity * x_velocity + z_velocity * z_velocity), 1.4142135623730951 * abs(z_velocity));
    end
  end
end
