"""What compensates an effect: a part that a lesson inserts like an effect, and that a control has as a table or a switch."""
