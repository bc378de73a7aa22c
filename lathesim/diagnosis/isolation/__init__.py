"""What a recording can tell, whatever is wrong: which effects it shows from which size on, and which of them it cannot tell apart."""
