function row = next_row(path, row)
  % The next segment that takes time.
  row = row + 1;
  while row <= rows(path) && !takes_time(path, row)
    row = row + 1;
  end
end
