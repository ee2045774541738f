"""``python -m tisim`` is the command ``tisim``, for use if the script is not on the path."""

from tisim.cli.main import main

if __name__ == "__main__":
    main()
