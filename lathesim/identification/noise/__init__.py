"""Models of noise: ``noise_model`` over frequency for replays, ``autoregressive`` in time for long residuals of a whole lesson."""
