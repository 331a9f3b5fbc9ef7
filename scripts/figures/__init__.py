"""The paper's figures again: see scripts/reproduce."""
