"""Op-amp circuits for mechanical models with clearances, and how many boards will work.

The names below are the whole for scripts (docs/python.md). Each is imported when it is first used,
so that worker processes and the command line load only what they need.
"""

import sys

# ``python -m designer`` has put the working directory first on the path: a model's folder may come
# from anyone, and a file in it named as a library is no library (SECURITY.md). While Python looks
# for the module of -m, argv[0] is "-m", and the module's name stands where argv's end begins.
if (
    sys.argv[:1] == ["-m"]
    and not sys.flags.safe_path
    and sys.orig_argv[-len(sys.argv)].removeprefix("-m") in ("designer", "designer.__main__")
):
    _working_directory = sys.path.pop(0)
    if __file__.startswith(_working_directory):  # a checkout that is not installed
        sys.path.append(_working_directory)

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
