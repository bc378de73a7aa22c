function roughness = surface_finish(feed, touching, p)
  % Theoretical roughness of the commanded feed.
  roughness = 0;
  if touching
    roughness = feed * feed / (32 * p.nose_radius);
  end
end
