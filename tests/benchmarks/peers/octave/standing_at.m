function radius = standing_at(s, cell, p)
  % Radius of the part in one cell, 0 outside.
  radius = 0;
  if cell >= 0 && cell < numel(s.removed)
    radius = p.stock_radius - s.removed(cell + 1);
  end
end
