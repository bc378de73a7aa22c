"""Screens and their dialogs; ``app`` imports a screen when it is first shown."""
