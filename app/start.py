"""Where the command begins: Ctrl+C is heard before anything slow is loaded."""

import os
import sys


def main() -> None:
    """Run the command line; see `app.cli.main`.

    Ctrl+C ends the process at once wherever no job has taken it over (see `app.progress.interruptible`): a module that
    is being loaded, above all one in C, can make anything of an exception.
    """
    # Python looks for modules in the present folder first, which may be anybody's pictures with a numpy.py among them:
    # no process that is started from here, by us or by a library, shall (CPython, PYTHONSAFEPATH).
    os.environ["PYTHONSAFEPATH"] = "1"
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")  # what Mesa complains of, our sentence and the doctor tell
    try:
        import signal

        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not ignored, as behind `&`
            signal.signal(signal.SIGINT, lambda number, frame: _leave())
    except KeyboardInterrupt:
        _leave()
    from app.cli import main

    main()


def _leave() -> None:
    abandon = getattr(sys.modules.get("app.progress"), "abandon", None)
    if abandon is not None:
        abandon()
    try:  # noqa: SIM105 - contextlib would have to be loaded first
        os.write(2, b"fluidwarp: interrupted\n")
    except OSError:  # the terminal may be gone
        pass
    os._exit(130)
