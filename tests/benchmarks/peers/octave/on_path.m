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
