"""What must hold for any input: functions of a seed, for the suite (a few seeds) and for nightly.py (many)."""
