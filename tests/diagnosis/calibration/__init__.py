"""Gates of the diagnosis: whether intervals, ties and the silence about sound machines are worth what they promise."""
