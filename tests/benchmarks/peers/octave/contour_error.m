function e = contour_error(x_reference, z_reference, x, z, direction_x, direction_z)
  % Contour error on straight segments, equation (10).
  e = (x_reference - x) * direction_z - (z_reference - z) * direction_x;
end
