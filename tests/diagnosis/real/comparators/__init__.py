"""Grey box with BIC, sparse regression and symbolic regression on the same recordings, so that the figures of the program have company."""
