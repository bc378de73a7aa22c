function record = lathe(p, path, tachometer_chance, dynamometer_chance, samples, period, step, steps)
  % The two-axis lathe, modular: one function a part, as the m-files of the 2004 paper; RK4 between the sample instants.
  s = zeros(1, 6);
  walk = struct('row', 1, 'travelled', 0, 'samples_left', 0, 'planned_speed', -1, 'path_speed', 0, 'at_end', false, 'started', false, 'done', false);
  memory = struct('before', 0, 'sum', 0, 'started', false);
  coupling_memory = memory;
  x_memory = memory;
  z_memory = memory;
  spindle_memory = memory;
  part = struct('removed', zeros(1, 2000), 'started', false);
  feed_command = -1;
  used = 0;
  record = zeros(samples, 30);
  for k = 1:samples
    walk = interpolator(walk, path, s(5), feed_command, p.interpolator, period);
    x_seen = encoder(s(2), p.x_encoder);
    z_seen = encoder(s(4), p.z_encoder);
    part = stock(part, s(2), s(4), p.stock);
    reading = nearest_level(tachometer(s(5), s(6), tachometer_chance(k), p.tachometer), p.tachometer_adc) / p.tachometer.gain;
    deviation = contour_error(walk.x_reference, walk.z_reference, x_seen, z_seen, walk.direction_x, walk.direction_z);
    actual = contour_error(walk.x_reference, walk.z_reference, s(2), s(4), walk.direction_x, walk.direction_z);
    [coupling_memory, coupling] = cross_coupling(coupling_memory, deviation, p.cross_coupling, period);
    [depth, feed, speed, radius, touching] = cutting_geometry(s(2), s(1), s(3), s(5), part.uncut, part.standing, walk.cutting_block, p.cutting);
    used = tool_wear(used, speed, touching, p.tool_wear, period);
    wear = p.tool_wear.wear_at_end_of_life * used;
    held.wear_factor = 1 + p.tool_wear.force_growth * wear;
    roughness = surface_finish(walk.programmed_feed, touching, p.surface_finish);
    [cutting, longitudinal, radial] = cutting_force(depth, feed, speed, touching, held.wear_factor, p.cutting_force);
    [x_load, z_load, torque] = cutting_load(cutting, longitudinal, radial, radius, s(1), s(3), s(5), p.stock.free_end, p.load);
    force_seen = nearest_level(dynamometer(cutting, dynamometer_chance(k), p.dynamometer), p.dynamometer_adc) / p.dynamometer.gain;
    feed_command = force_controller(feed_command, force_seen, walk.programmed_feed, walk.cutting_block, p.process_controller, period);
    [x_memory, x_voltage] = controller(x_memory, walk.x_reference, x_seen, coupling * walk.direction_z, p.x_controller, p.x_dac, period);
    [z_memory, z_voltage] = controller(z_memory, walk.z_reference, z_seen, -coupling * walk.direction_x, p.z_controller, p.z_dac, period);
    [spindle_memory, voltage] = controller(spindle_memory, walk.spindle_reference, reading, 0, p.spindle_controller, p.spindle_dac, period);
    held.x_volts = nearest_level(x_voltage, p.x_dac);
    held.z_volts = nearest_level(z_voltage, p.z_dac);
    held.spindle_volts = nearest_level(voltage, p.spindle_dac);
    held.uncut = part.uncut;
    held.standing = part.standing;
    held.cutting_block = walk.cutting_block;
    record(k, :) = [walk.x_reference, walk.z_reference, walk.path_speed, walk.spindle_reference, walk.row - 1, walk.cutting_block, ...
                    x_seen, x_memory.before, held.x_volts, s(2), s(1), z_seen, z_memory.before, held.z_volts, s(4), s(3), ...
                    coupling, actual, reading, held.spindle_volts, s(5), depth, feed, speed, cutting, longitudinal, radial, ...
                    torque, wear, roughness];
    if walk.done
      record = record(1:k, :);
      return
    end
    for substep = 1:steps
      k1 = rates(s, held, p);
      k2 = rates(s + 0.5 * step * k1, held, p);
      k3 = rates(s + 0.5 * step * k2, held, p);
      k4 = rates(s + step * k3, held, p);
      s = s + step / 6 * (k1 + 2 * (k2 + k3) + k4);
    end
  end
end

function e = contour_error(x_reference, z_reference, x, z, direction_x, direction_z)
  % Contour error on straight segments, equation (10).
  e = (x_reference - x) * direction_z - (z_reference - z) * direction_x;
end

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

function [s, voltage] = cross_coupling(s, deviation, p, period)
  % Cross-coupling controller: a PID of the sensed contour error.
  slope = 0;
  if s.started
    slope = (deviation - s.before) / period;
  end
  total = s.sum + deviation * period;
  voltage = p.proportional * deviation + p.integral * total + p.derivative_gain * slope;
  if abs(voltage) > p.largest_voltage && voltage * p.integral * deviation > 0
    total = s.sum;
    voltage = p.proportional * deviation + p.integral * total + p.derivative_gain * slope;
  end
  voltage = max(-p.largest_voltage, min(p.largest_voltage, voltage));
  s.sum = total;
  s.before = deviation;
  s.started = true;
end

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

function [acceleration, velocity] = drive(speed, voltage, load, p)
  % Axis or spindle as a first-order lag, equation (9).
  acceleration = (p.gain * voltage - p.disturbance_gain * load - speed) / p.time_constant;
  velocity = speed;
end

function voltage = dynamometer(force, chance, p)
  % Dynamometer with noise and bias.
  voltage = p.gain * force + p.bias + p.noise * chance;
end

function counted = encoder(position, p)
  % A linear encoder: the position in whole counts.
  counted = p.resolution * floor(position / p.resolution + 0.5);
end

function feed = force_controller(held, measured, programmed, cutting_block, p, period)
  % Force controller that undoes the power of the feed, equation (26).
  if !cutting_block
    feed = -1;
    return
  end
  if held < 0
    feed = min(max(programmed, p.smallest_feed), p.largest_feed);
    return
  end
  theta = p.force_gain * (p.depth_of_cut / 1e-3) ^ p.depth_exponent * (p.cutting_speed / (1000 / 60)) ^ p.speed_exponent;
  control = (held / 1e-3) ^ p.feed_exponent + period * (p.reference - measured) / (p.time_constant * theta);
  if control <= 0
    feed = p.smallest_feed;
  elseif log(control) / p.feed_exponent > log(p.largest_feed / 1e-3)
    feed = p.largest_feed;
  else
    feed = min(max(1e-3 * control ^ (1 / p.feed_exponent), p.smallest_feed), p.largest_feed);
  end
end

function s = interpolator(s, path, spindle_speed, feed_command, p, period)
  % Constant-velocity interpolator: one sample further along the path.
  if !s.started
    s.at_end = !takes_time(path, 1);
    s.started = true;
  elseif !s.done
    if s.at_end
      s.row = next_row(path, s.row);
      s.travelled = 0;
      s.samples_left = 0;
      s.planned_speed = -1;
    end
    now = path(s.row, :);
    if now(1) == 0
      wanted = p.rapid_speed;
    elseif feed_command < 0
      wanted = now(12);
    else
      wanted = feed_command * abs(spindle_speed) / (2 * pi);
    end
    way = wanted * period;
    steady = abs(wanted - s.planned_speed) <= 1e-9 * wanted;
    s.at_end = false;
    if !steady || s.samples_left < 0.5
      rest = max(1, ceil((now(2) - s.travelled) / way - 1e-6));
      if s.planned_speed >= 0 && !steady && rest > 4
        s.samples_left = 0;
      else
        s.samples_left = rest;
      end
      s.planned_speed = wanted;
    end
    if s.samples_left > 0.5
      way = (now(2) - s.travelled) / s.samples_left;
      s.samples_left = s.samples_left - 1;
      s.at_end = s.samples_left < 0.5;
    end
    s.path_speed = way / period;
    if s.at_end
      s.travelled = now(2);
    else
      s.travelled = s.travelled + way;
    end
    s.done = s.at_end && next_row(path, s.row) > rows(path);
  end
  segment = path(s.row, :);
  motion = s.row;
  while motion >= 1 && !takes_time(path, motion)
    motion = motion - 1;
  end
  if motion < 1
    motion = next_row(path, s.row);
  end
  moving = path(motion, :);
  s.x_reference = on_path(segment, s.travelled, 3, 5);
  s.z_reference = on_path(segment, s.travelled, 4, 6);
  s.direction_x = (moving(5) - moving(3)) / moving(2);
  s.direction_z = (moving(6) - moving(4)) / moving(2);
  s.cutting_block = segment(1) == 1;
  s.spindle_reference = 0;
  if segment(14) == 1
    s.spindle_reference = segment(15);
  end
  s.programmed_feed = 0;
  if s.cutting_block && s.spindle_reference != 0
    s.programmed_feed = s.path_speed * 2 * pi / abs(s.spindle_reference);
  end
end

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

function row = next_row(path, row)
  % The next segment that takes time.
  row = row + 1;
  while row <= rows(path) && !takes_time(path, row)
    row = row + 1;
  end
end

function place = on_path(segment, travelled, first, last)
  % A coordinate of the point some way along a segment.
  len = segment(2);
  if segment(1) > 2 || len <= 0 || travelled <= 0
    place = segment(first);
  elseif travelled >= len
    place = segment(last);
  else
    place = segment(first) + (segment(last) - segment(first)) * (travelled / len);
  end
end

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

function radius = standing_at(s, cell, p)
  % Radius of the part in one cell, 0 outside.
  radius = 0;
  if cell >= 0 && cell < numel(s.removed)
    radius = p.stock_radius - s.removed(cell + 1);
  end
end

function s = stock(s, x, z, p)
  % The part being cut: what the tool takes off, and what stands beside it.
  cells = numel(s.removed);
  if !s.started
    s.x_before = x;
    s.z_before = z;
    s.started = true;
  end
  width = p.stock_length / cells;
  here = (z - p.face) / width;
  there = (s.z_before - p.face) / width;
  inside = z >= p.face && z <= p.face + p.stock_length;
  cell = floor(here);
  if inside && cell >= cells
    cell = cells - 1;
  end
  first = max(0, floor(min(here, there) + 0.5));
  last = min(cells - 1, floor(max(here, there) - 0.5));
  for i = first:last
    share = 1;
    if here != there
      share = (i + 0.5 - there) / (here - there);
    end
    tip = max(s.x_before + share * (x - s.x_before), 0);
    if p.stock_radius - s.removed(i + 1) > tip
      s.removed(i + 1) = p.stock_radius - tip;
    end
  end
  s.uncut = 0;
  s.standing = 0;
  if inside
    left = standing_at(s, cell - 1, p);
    middle = standing_at(s, cell, p);
    right = standing_at(s, cell + 1, p);
    s.standing = max([left, middle, right]);
    if z > s.z_before
      s.uncut = right;
    elseif z < s.z_before
      s.uncut = left;
    else
      s.uncut = s.standing;
    end
    if s.uncut == 0
      s.uncut = middle;
    end
  end
  s.x_before = x;
  s.z_before = z;
end

function roughness = surface_finish(feed, touching, p)
  % Theoretical roughness of the commanded feed.
  roughness = 0;
  if touching
    roughness = feed * feed / (32 * p.nose_radius);
  end
end

function voltage = tachometer(speed, angle, chance, p)
  % Tachometer with noise, bias and ripple.
  voltage = p.gain * speed + p.bias + p.noise * chance + p.ripple * sin(p.ripples * angle);
end

function answer = takes_time(path, row)
  % Whether a segment of the path is a motion with a length.
  answer = path(row, 1) <= 2 && path(row, 2) > 0;
end

function used = tool_wear(used, speed, touching, p, period)
  % Share of the tool's life used up, Taylor's law.
  if touching && speed >= p.slowest_cutting_speed
    logarithm = log(p.taylor_constant / speed) / p.taylor_exponent;
    used = used + period / (60 * exp(max(-60, min(60, logarithm))));
  end
end
