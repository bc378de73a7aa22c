"""Parameters from recordings: least squares, covariance, bias, transfer to another recording."""
