"""Pictures in characters, drawn with numpy; nothing here imports Textual."""
