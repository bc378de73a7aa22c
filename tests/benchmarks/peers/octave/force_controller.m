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
