function [cutting, longitudinal, radial] = cutting_force(depth, feed, speed, touching, wear_factor, p)
  % Nonlinear cutting force, equations (12) to (18).
  cutting = 0;
  longitudinal = 0;
  radial = 0;
  if touching && depth > 0 && feed > 0 && speed >= p.slowest_cutting_speed
    log_feed = log(feed / 1e-3);
    log_depth = log(depth / 1e-3);
    log_speed = log(speed / (1 / 60));
    area = wear_factor * feed * depth;
    cutting = area * p.cutting_pressure * exp(p.cutting_feed_exponent * log_feed + p.cutting_depth_exponent * log_depth + p.cutting_speed_exponent * log_speed);
    thrust = area * p.thrust_pressure * exp(p.thrust_feed_exponent * log_feed + p.thrust_depth_exponent * log_depth + p.thrust_speed_exponent * log_speed);
    longitudinal = thrust * sin(p.lead_angle);
    radial = thrust * cos(p.lead_angle);
  end
end
