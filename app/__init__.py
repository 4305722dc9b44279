"""The program: the command line, the window, and all that is not physics."""

import os

# The threads of linear algebra, which here is of a few hundred numbers, wait for one another at full speed wherever the
# cores are busy drawing; and what they find differs in its last digits with their number.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy is loaded
