"""Explanations of a recording: each is fitted on one recording and judged by how well it predicts another one."""
