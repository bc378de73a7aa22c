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
