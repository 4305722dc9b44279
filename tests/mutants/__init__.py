"""Who tests the tests: a catalogue of single plausible faults, and what puts each into a copy of the program."""
