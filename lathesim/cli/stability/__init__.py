"""Commands: chatter, from the tap of a hammer to the map."""
