"""The package's version, as it was installed."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("wam-cast")
except PackageNotFoundError:  # a source tree that was never installed
    __version__ = "0+unknown"
