"""Where the application begins: the command line; a Python where the program starts one of its own parts."""

from __future__ import annotations

import multiprocessing
import runpy
import sys


def start() -> None:
    multiprocessing.freeze_support()
    match sys.argv[1:]:
        # As `python -m MODULE` and `python -c CODE` do: processes of a job, doctor's looks at the machine.
        case ["-m", module, *rest]:
            sys.argv = [module, *rest]
            runpy.run_module(module, run_name="__main__")
        case ["-c", code]:
            sys.argv = ["-c"]
            exec(code, {"__name__": "__main__"})
        case _:
            from app.start import main

            main()


if __name__ == "__main__":
    start()
