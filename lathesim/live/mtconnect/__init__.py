"""An MTConnect agent, its client, and SHDR."""
