"""What a simulation leaves out of a stream: residuals, their sums over blocks, and what is usual of them."""
