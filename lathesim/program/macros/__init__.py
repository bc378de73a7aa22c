"""What a part program computes: expressions, variables, and the statements that choose which block comes next."""
