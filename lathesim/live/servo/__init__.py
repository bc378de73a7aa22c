"""Set-points streamed to the servo side of a machine."""
