"""Parts of the closed machine-tool controller: continuous loops whose feedback arrives after a transport delay."""
