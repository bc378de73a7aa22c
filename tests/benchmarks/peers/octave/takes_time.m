function answer = takes_time(path, row)
  % Whether a segment of the path is a motion with a length.
  answer = path(row, 1) <= 2 && path(row, 2) > 0;
end
