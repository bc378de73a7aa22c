"""The steps of a block and what they remember, each class of steps built on the one before: motions, contours, cycles, flow, offsets."""
