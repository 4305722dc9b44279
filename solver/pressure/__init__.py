"""The pressure projection."""
