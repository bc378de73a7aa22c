"""What may explain a recording: models that predict its channels and compete by how well they do."""
