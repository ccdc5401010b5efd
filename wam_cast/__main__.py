"""`python -m wam_cast` is `wam-cast`."""

from wam_cast.cli import main

if __name__ == "__main__":
    main()
