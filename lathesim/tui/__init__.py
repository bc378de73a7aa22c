"""The terminal UI. ``model`` and ``drawing`` know nothing of Textual; ``widgets`` and ``screens`` show what they hold."""
