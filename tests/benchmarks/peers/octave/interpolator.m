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
