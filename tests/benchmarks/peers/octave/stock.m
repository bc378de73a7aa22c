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
