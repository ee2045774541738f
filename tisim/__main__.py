"""``python -m tisim`` is the command ``tisim``, also where no script of that name is on the path."""

from tisim.cli.main import main

if __name__ == "__main__":
    main()
