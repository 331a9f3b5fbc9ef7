"""Reproduces the paper's figures; see scripts/reproduce."""
