function counted = encoder(position, p)
  % A linear encoder: the position in whole counts.
  counted = p.resolution * floor(position / p.resolution + 0.5);
end
